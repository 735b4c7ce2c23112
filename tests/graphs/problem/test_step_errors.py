# SPDX-License-Identifier: BSD-3-Clause
"""What a step misses: nothing of a smooth motion, much where friction stops a light joint within a part of it."""

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.step_errors import step_errors
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream

PERIOD = 2.5e-3
URDF = """<robot name="p"><link name="base"/><joint name="j" type="revolute"><parent link="base"/><child link="bar"/>
<axis xyz="0 1 0"/><limit effort="80" velocity="9" lower="-3" upper="3"/></joint>
<link name="bar"><inertial><origin xyz="0 0 0.1"/><mass value="{mass}"/>
<inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
YAML = """
format: 1
name: p
urdf: p.urdf
gravity: [0.0, 0.0, -9.81]
joints: [j]
model: {{rigid_joints: [j], integrator: {rule}}}
command: {{topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}}
sensors:
  enc: {{kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: rad, sigma: 1.0e-4}}
parameters:
  j.inertia: {{value: {inertia}, unit: kg m2}}
  j.coulomb_torque: {{value: {dry}, unit: N m}}
noise: {{link_velocity: [{noise}], motor_velocity: [{noise}]}}
"""


def missed(tmp_path, mass, dry, rule="simpson", noise=0.01):
    """Of a bar that swings through reversals, 10 cm from its joint."""
    (tmp_path / "p.urdf").write_text(URDF.format(mass=mass, inertia=1e-3 * mass))
    (tmp_path / "p.yaml").write_text(YAML.format(rule=rule, inertia=1e-3 * mass, dry=dry, noise=noise))
    robot = load_robot(tmp_path / "p.yaml")
    times = np.arange(0.0, 4.0, PERIOD)
    q = 0.5 * np.sin(3.0 * times)
    command = Stream("command", times, np.zeros((len(times), 1)), ("j",), "N m")
    encoder = Stream(robot.motor_encoder.name, times, q[:, None], ("j.motor_position",), "rad")
    problem = BagProblem.of(robot, Recording("p.mcap", "", 0, {"command": command, encoder.name: encoder}))
    ticks = problem.timeline.ticks
    x = np.column_stack([0.5 * np.sin(3.0 * ticks), 1.5 * np.cos(3.0 * ticks)])
    order = np.argsort([problem.robot.layout.positions[0], problem.robot.layout.velocities[0]])
    return step_errors(problem, x[:, order], Calibration.of(robot))


def test_arms_that_turn_over_slowly_or_without_friction_miss_nothing(tmp_path):
    assert missed(tmp_path, mass=20.0, dry=1e-9).max() < 1e-3
    assert missed(tmp_path, mass=20.0, dry=0.5).max() < 0.03


@pytest.mark.parametrize("mass", [0.02, 0.2])
def test_a_light_bar_that_friction_stops_at_once_misses_much(tmp_path, mass):
    assert missed(tmp_path, mass=mass, dry=0.5).max() > 1.0
    assert missed(tmp_path, mass=10.0 * mass, dry=0.5).max() < missed(tmp_path, mass=mass, dry=0.5).max()


def test_no_harm_was_done_where_no_random_torque_has_risen(tmp_path):
    assert missed(tmp_path, mass=0.02, dry=0.5, noise=1e-3).max() == 0.0


def test_rules_that_a_file_asks_for_are_taken_as_they_are(tmp_path):
    assert missed(tmp_path, mass=0.02, dry=0.5, rule="euler").max() == 0.0
