# SPDX-License-Identifier: BSD-3-Clause
"""A joint that is elastic in truth and rigid in the robot file: its spring is added, and calibrated from its start."""

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.problem.joint_states import JointStates
from jointscope.robots.files.effects_at_once import add_effects
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator import simulate

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

URDF = """<robot name="arm"><link name="base"/>
<joint name="elbow" type="revolute"><parent link="base"/><child link="forearm"/><axis xyz="0 0 1"/>
 <limit effort="30" velocity="10" lower="-3" upper="3"/></joint>
<link name="forearm"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>
 <inertia ixx="0.02" iyy="0.04" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
ROBOT = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [elbow]
MODEL
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: A}
sensors:
  enc: {kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position, unit: rad,
        sigma: 7.0e-5}
  imu: {kind: gyro, topic: /imu/data, type: sensor_msgs/msg/Imu, field: angular_velocity, unit: rad/s, body: forearm,
        sigma: 2.0e-3, R_imu_body: {value: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], prior_sigma: 0.01}}
parameters:
  elbow.inertia: {value: 0.08, unit: kg m2, prior_sigma: 0.2}
  elbow.coulomb_torque: {value: 0.4, unit: N m, prior_sigma: 1.0}
  elbow.torque_constant: {value: 2.0, unit: N m/A, prior_sigma: 4.0}
SPRING
noise: {estimate: true, link_velocity: [0.3], motor_velocity: [0.3]}
"""
SPRING = """  elbow.stiffness: {value: 250.0, unit: N m/rad}
  elbow.damping: {value: 0.6, unit: N m s/rad}
"""


@pytest.fixture(scope="module")
def robots(tmp_path_factory):
    """The robot with its spring, and as a file says that takes the joint for rigid."""
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.urdf").write_text(URDF, encoding="utf-8")
    (folder / "elastic.yaml").write_text(ROBOT.replace("MODEL\n", "").replace("SPRING\n", SPRING), encoding="utf-8")
    rigid = ROBOT.replace("MODEL", "model: {rigid_joints: [elbow]}").replace("SPRING\n", "")
    (folder / "rigid.yaml").write_text(rigid, encoding="utf-8")
    return load_robot(folder / "elastic.yaml"), load_robot(folder / "rigid.yaml")


def within(result, name, truth, sigmas=3.0):
    found = result.robot.parameters[name]
    assert abs(found.value - truth) < sigmas * found.sigma, f"{name}: {found.value} +- {found.sigma}, true {truth}"
    assert found.sigma < 0.02 * truth, name


def test_an_added_spring_is_found_by_a_calibration_that_guesses_first(robots):
    elastic, rigid = robots
    recording = simulate(elastic, "calibration", 2.0, seed=4, friction="smooth").recording
    start = add_effects(rigid, ["joint_elasticity@elbow"]).robot
    off = start.with_values({"elbow.torque_constant": 1.3, "elbow.inertia": 0.05})
    result = calibrate(off, [recording])
    within(result, "elbow.joint_elasticity.compliance", 1.0 / 250.0)
    within(result, "elbow.joint_elasticity.damping", 0.6)
    within(result, "elbow.torque_constant", 2.0)
    within(result, "elbow.inertia", 0.08)


def test_play_added_to_a_rigid_joint_is_found_together_with_the_spring(robots):
    elastic, rigid = robots
    play = ["backlash@elbow:half_gap=0.004"]
    recording = simulate(elastic, "calibration", 2.0, seed=4, friction="smooth", effects=play).recording
    result = calibrate(add_effects(rigid, ["backlash@elbow"]).robot, [recording])
    within(result, "elbow.joint_elasticity.compliance", 1.0 / 250.0)
    within(result, "elbow.backlash.half_gap", 0.004)


def test_the_load_of_an_added_spring_is_known(robots):
    elastic, rigid = robots
    added = add_effects(rigid, ["joint_elasticity@elbow"]).robot
    K, D = 250.0, 0.6
    added = added.with_values({"elbow.joint_elasticity.compliance": 1.0 / K, "elbow.joint_elasticity.damping": D})
    x = np.random.default_rng(2).normal(size=(5, 4))
    loads = [JointStates.of(robot, np.arange(5.0), x).load for robot in (elastic, added)]
    np.testing.assert_allclose(*loads, rtol=1e-12)
    assert np.all(np.isnan(JointStates.of(rigid, np.arange(5.0), x[:, :2]).load))
