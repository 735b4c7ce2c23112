# SPDX-License-Identifier: BSD-3-Clause
"""What steps miss moves no inertia of a heavy bar, and that of a light one that friction stops within them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.step_errors import inertia_shifts
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


def moved(mass, dry, seconds=2.0):
    """States at each command, and the commands, of a bar that a controller swings, by a stiff integrator."""
    inertia, weight = 1e-3 * mass + mass * 0.1**2 + 1e-3 * mass, mass * 9.81 * 0.1
    times, x, found, commands = np.arange(0.0, seconds, PERIOD), np.array([0.0, 1.5]), [], []
    for t in times:
        q, v = 0.5 * np.sin(3.0 * t), 1.5 * np.cos(3.0 * t)
        u = inertia * (900.0 * (q - x[0]) + 60.0 * (v - x[1]) - 9.0 * q) - weight * np.sin(x[0]) + dry * np.sign(v)
        found.append(x)
        commands.append(u)

        def rates(_, x, u=u):
            return x[1], (u + weight * np.sin(x[0]) - dry * np.tanh(200.0 * x[1])) / inertia

        x = solve_ivp(rates, (0.0, PERIOD), x, "Radau", rtol=1e-8, atol=1e-10).y[:, -1]
    return times, np.array(found), np.array(commands)


def shift(tmp_path, mass, dry, rule="simpson", noise=0.01):
    """Of the inertia of a bar that swings through reversals, 10 cm from its joint, and that of its exact states."""
    (tmp_path / "p.urdf").write_text(URDF.format(mass=mass, inertia=1e-3 * mass))
    (tmp_path / "p.yaml").write_text(YAML.format(rule=rule, inertia=1e-3 * mass, dry=dry, noise=noise))
    robot = load_robot(tmp_path / "p.yaml")
    times, states, commands = moved(mass, dry)
    command = Stream("command", times, commands[:, None], ("j",), "N m")
    encoder = Stream(robot.motor_encoder.name, times, states[:, :1], ("j.motor_position",), "rad")
    problem = BagProblem.of(robot, Recording("p.mcap", "", 0, {"command": command, encoder.name: encoder}))
    assert len(problem.timeline.ticks) == len(states)
    order = np.argsort([problem.robot.layout.positions[0], problem.robot.layout.velocities[0]])
    x, calibration = states[:, order], Calibration.of(robot)
    found = inertia_shifts(problem, x, calibration).get("j.inertia", 0.0)
    if rule != "simpson":
        return found, 0.0
    linear, sigmas = problem.dynamics.linearize_chain(x, calibration), problem.dynamics.sigmas
    slopes = linear.by_block[DYNAMICS] / sigmas[:, :, None]
    needed = np.linalg.lstsq(slopes.reshape(-1, slopes.shape[2]), (-linear.residual / sigmas).reshape(-1))[0]
    return found, needed[calibration.names.index("j.inertia")]


def test_inertias_of_heavy_bars_and_of_those_without_friction_stay(tmp_path):
    assert abs(shift(tmp_path, mass=20.0, dry=1e-9)[0]) < 1e-4
    assert abs(shift(tmp_path, mass=20.0, dry=0.5)[0]) < 1e-3


@pytest.mark.parametrize("mass", [0.1, 0.2])
def test_what_is_missed_moves_the_inertia_of_a_light_bar_as_its_exact_states_do(tmp_path, mass):
    found, needed = shift(tmp_path, mass=mass, dry=0.5)
    assert abs(found) > 0.01
    assert 0.5 < found / needed < 2.0


def test_no_harm_was_done_where_no_random_torque_has_risen(tmp_path):
    assert shift(tmp_path, mass=0.02, dry=0.5, noise=1e-3)[0] == 0.0


def test_rules_that_a_file_asks_for_are_taken_as_they_are(tmp_path):
    assert shift(tmp_path, mass=0.02, dry=0.5, rule="euler")[0] == 0.0
