# SPDX-License-Identifier: BSD-3-Clause
"""A joint with play beside one whose standstill says how sharply its friction turns over."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.problem.timeline import Timeline
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.simulation import simulate

pytest.importorskip("mujoco", reason="the arm is moved by MuJoCo, which the extra `sim` brings")

URDF = """<robot name="arm"><link name="base"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
 <limit effort="30" velocity="30" lower="-9" upper="9"/></joint>
<link name="l1"><inertial><origin xyz="0.1 0 0"/><mass value="1.5"/>
 <inertia ixx="0.004" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
 <limit effort="15" velocity="30" lower="-9" upper="9"/></joint>
<link name="l2"><inertial><origin xyz="0.1 0 0"/><mass value="0.7"/>
 <inertia ixx="0.002" iyy="0.008" izz="0.008" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
ROBOT = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [j1, j2]
model: {rigid_joints: [j1]}
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  motors: {kind: motor_encoder, topic: /m, type: sensor_msgs/msg/JointState, field: position, unit: rad, sigma: 2.0e-5}
  links: {kind: link_encoder, topic: /l, type: sensor_msgs/msg/JointState, field: position, unit: rad, sigma: 2.0e-5}
parameters:
  j1.inertia: {value: 0.2, unit: kg m2, prior_sigma: 0.2}
  j2.inertia: {value: 0.05, unit: kg m2, prior_sigma: 0.05}
  j2.stiffness: {value: 200.0, unit: N m/rad, prior_sigma: 100.0}
  j2.damping: {value: 0.3, unit: N m s/rad, prior_sigma: 0.3}
  j1.coulomb_torque: {value: 1.5, unit: N m, prior_sigma: 1.5}
  j2.coulomb_torque: {value: 0.3, unit: N m, prior_sigma: 0.3}
  j1.friction_sharpness: {value: 100.0, unit: s/rad, prior_sigma: 100.0}
noise: {estimate: true, link_velocity: [0.003, 0.003], motor_velocity: [0.003, 0.003]}
"""


def test_its_blows_are_followed_within_steps_where_standstill_is_asked(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "arm.yaml").write_text(ROBOT, encoding="utf-8")
    robot = load_robot(tmp_path / "arm.yaml")
    truth, played = {"j1.friction_sharpness": 30.0}, "backlash@j2:half_gap=0.02"
    how = {"friction": "smooth", "encoder_rate": 250.0, "quantized": False}
    recording = simulate(robot, "calibration", 4.0, seed=3, parameters=truth, effects=[played], **how).recording
    result = calibrate(add_effect(robot, "backlash@j2"), [recording])
    found = {p.name: p for p in result.parameters}
    assert found["j1.friction_sharpness"].value == pytest.approx(30.0, rel=0.005)  # its standstill was asked
    assert found["j2.backlash.half_gap"].value == pytest.approx(0.02, rel=0.002)
    assert found["j2.damping"].value == pytest.approx(0.3, rel=0.005)
    ticks = result.bags[0].ticks
    whole = Timeline.of(recording).ticks
    assert np.isin(whole, ticks).all() and len(ticks) > len(whole)
