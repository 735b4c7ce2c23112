# SPDX-License-Identifier: BSD-3-Clause
"""Two joints with stiff springs that the robot file calls rigid, seen by the encoders of their motors alone."""

from __future__ import annotations

import pytest

from jointscope.graphs.discovery.discover import discover
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator import simulate

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

URDF = """<robot name="arm"><link name="base"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
 <limit effort="100" velocity="5" lower="-2" upper="2"/></joint>
<link name="upper"><inertial><origin xyz="0.18 0 0"/><mass value="6"/>
 <inertia ixx="0.01" iyy="0.08" izz="0.08" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
 <limit effort="40" velocity="5" lower="-2" upper="2"/></joint>
<link name="fore"><inertial><origin xyz="0.15 0 0"/><mass value="3"/>
 <inertia ixx="0.004" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
ROBOT = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [shoulder, elbow]
MODEL
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  enc: {kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position, unit: rad,
        sigma: 5.0e-6}
parameters:
  shoulder.inertia: {value: 0.8, unit: kg m2, prior_sigma: 1.6}
  elbow.inertia: {value: 0.3, unit: kg m2, prior_sigma: 0.6}
  shoulder.coulomb_torque: {value: 2.0, unit: N m, prior_sigma: 4.0}
  elbow.coulomb_torque: {value: 1.0, unit: N m, prior_sigma: 2.0}
SPRINGS
noise: {estimate: true, link_velocity: [0.003, 0.003], motor_velocity: [0.003, 0.003]}
"""
STIFFNESS = {"shoulder": 9000.0, "elbow": 2500.0}  # [N m/rad]
SPRINGS = """  shoulder.stiffness: {value: 9000.0, unit: N m/rad}
  shoulder.damping: {value: 12.0, unit: N m s/rad}
  elbow.stiffness: {value: 2500.0, unit: N m/rad}
  elbow.damping: {value: 2.0, unit: N m s/rad}"""
RIGID = "model: {rigid_joints: [shoulder, elbow]}"


@pytest.mark.slow
def test_both_springs_are_found_and_none_stands_for_the_other(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "elastic.yaml").write_text(ROBOT.replace("MODEL\n", "").replace("SPRINGS", SPRINGS), encoding="utf-8")
    (tmp_path / "rigid.yaml").write_text(ROBOT.replace("MODEL", RIGID).replace("SPRINGS\n", ""), encoding="utf-8")
    robot = load_robot(tmp_path / "elastic.yaml")
    recording = simulate(robot, "calibration", 6.0, seed=3, friction="smooth").recording
    found = discover(load_robot(tmp_path / "rigid.yaml"), [recording], missing_torque=False)
    assert {step.added for step in found.steps[1:3]} == {"joint_elasticity@shoulder", "joint_elasticity@elbow"}
    for joint, stiffness in STIFFNESS.items():
        compliance = found.steps[2].robot.parameters[f"{joint}.joint_elasticity.compliance"]
        assert abs(compliance.value - 1.0 / stiffness) < 3.0 * compliance.sigma
        assert compliance.value == pytest.approx(1.0 / stiffness, rel=0.05)
