# SPDX-License-Identifier: BSD-3-Clause
"""An arm of two joints with gravity, whose frames and axes are turned against each other."""

from jointscope.robots.files.robot_file import load_robot

URDF = """<robot name="arm"><link name="base"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
 <origin xyz="0.1 0.2 0.3" rpy="0.4 -0.3 0.2"/><axis xyz="0 1 0"/>
 <limit effort="80" velocity="{speed}" lower="-3" upper="3"/></joint>
<link name="upper"><inertial><origin xyz="0.1 0 0.2"/><mass value="3"/>
 <inertia ixx="0.05" iyy="0.05" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4" rpy="0.5 0.1 0"/>
 <axis xyz="0.6 0 -0.8"/><limit effort="40" velocity="{speed}" lower="-2" upper="2"/></joint>
<link name="fore"><inertial><origin xyz="0.05 0 0.15"/><mass value="2"/>
 <inertia ixx="0.03" iyy="0.01" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
YAML = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [shoulder, elbow]
model: {{rigid_joints: [{rigid}]}}
command: {{topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: {unit}}}
sensors:
  enc: {{kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: rad, sigma: 1.0e-4}}
parameters:
{parameters}
noise: {{link_velocity: [0.3, 0.3], motor_velocity: [0.3, 0.3]}}
"""
ROTORS, FRICTION, CONSTANT = {"shoulder": 0.5, "elbow": 0.2}, 0.8, 2.5


def arm_with(tmp_path, rigid=("shoulder", "elbow"), unit="N m"):
    """The arm with some joints rigid, the others with a spring; commands in `unit`, at most 4 rad/s."""
    lines = []
    for joint, inertia in ROTORS.items():
        lines += [f"{joint}.inertia: {{value: {inertia}, unit: kg m2}}"]
        lines += [f"{joint}.coulomb_torque: {{value: {FRICTION}, unit: N m}}"]
        if unit == "A":
            lines += [f"{joint}.torque_constant: {{value: {CONSTANT}, unit: N m/A}}"]
        if joint not in rigid:
            lines += [f"{joint}.stiffness: {{value: 900.0, unit: N m/rad}}"]
            lines += [f"{joint}.damping: {{value: 1.0, unit: N m s/rad}}"]
    (tmp_path / "arm.urdf").write_text(URDF.format(speed=4))
    text = YAML.format(rigid=", ".join(rigid), unit=unit, parameters="\n".join(f"  {line}" for line in lines))
    (tmp_path / "arm.yaml").write_text(text)
    return load_robot(tmp_path / "arm.yaml")
