# SPDX-License-Identifier: BSD-3-Clause
"""Steps are divided where a spring meets an edge of its dead zone fast, and nowhere else."""

import numpy as np
import pytest

from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.dead_zone_edges import PARTS, DeadZoneEdges
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.simulation import simulate

pytest.importorskip("mujoco", reason="the arm is moved by MuJoCo, which the extra `sim` brings")

JOINTS = ("joint1", "joint2", "joint3", "joint4")


@pytest.fixture(scope="module")
def robot():
    return add_effect(load_robot("biorob"), "spring_slack@joint4", {"forward": 0.1, "backward": 0.05})


def deflected(robot, angles):
    """States of springs 4 that are bent by angles, at rest; the transmission carries joint 3 into joint 4."""
    x = np.zeros((len(angles), robot.layout.size))
    x[:, robot.layout.motor_q[3]] = -np.asarray(angles)
    return x


@pytest.mark.parametrize(
    ("begin", "end", "met"),
    [
        (0.09, 0.11, True),  # out of the dead zone
        (0.11, 0.09, True),
        (-0.04, -0.06, True),
        (-0.2, 0.2, True),  # through all of it
        (0.02, 0.04, False),  # within
        (0.2, 0.3, False),  # beyond
        (-0.06, -0.08, False),
        (0.0999, 0.1001, False),  # too slow to miss the corner
    ],
)
def test_a_step_meets_an_edge_that_it_crosses_fast(robot, begin, end, met):
    edges = DeadZoneEdges.of(robot)
    assert edges.met(deflected(robot, [begin]), deflected(robot, [end])) == [met]


def test_robots_without_dead_zones_and_steps_that_a_file_asks_for_have_no_edges():
    assert DeadZoneEdges.of(load_robot("biorob")) is None
    assert DeadZoneEdges.of(add_effect(load_robot("biorob"), "backlash@joint1", {"half_gap": 0.0})) is None
    assert DeadZoneEdges.of(add_effect(load_robot("doggy_paper"), "backlash@joint1")) is None  # Euler steps


def test_only_steps_over_an_edge_are_divided_and_the_recording_stays_divided(robot):
    problem = BagProblem.of(robot, simulate(load_robot("biorob"), "moves", 1.0, seed=1).recording)
    ticks, x = problem.timeline.ticks, deflected(robot, np.full(len(problem.timeline.ticks), 0.02))
    assert problem.divided(x, {})[0] is problem
    x[100:] = deflected(robot, [0.2])
    short, states = problem.divided(x, {})
    inside = (short.timeline.ticks > ticks[99]) & (short.timeline.ticks < ticks[100])
    assert inside.sum() == PARTS - 1 == len(short.timeline.ticks) - len(ticks)
    np.testing.assert_allclose(states[np.searchsorted(short.timeline.ticks, ticks)], x, atol=1e-12)
    np.testing.assert_array_equal(short.of_robot(robot).timeline.ticks, short.timeline.ticks)
    wider = {"joint4.spring_slack.forward": 0.3}
    assert problem.divided(x, wider)[0] is problem


def test_motors_stand_where_they_did_however_many_steps_are_divided(robot):
    light = {f"{joint}.coulomb_torque": 0.3 * robot.drive_parameter(joint, "coulomb_torque").value for joint in JOINTS}
    problem = BagProblem.of(robot.with_values(light), simulate(load_robot("biorob"), "moves", 1.0, seed=1).recording)
    count = len(problem.timeline.ticks)
    x = deflected(robot, np.where(np.arange(count) < count // 2, 0.02, 0.2 * (np.arange(count) % 2)))
    short, _ = problem.divided(x, {})
    assert np.median(short.timeline.h) < 0.2 * np.median(problem.timeline.h)
    ticks = np.arange(count)
    stands = problem.motor_stands(ticks)
    assert stands.any()
    of_same = np.searchsorted(short.timeline.ticks, problem.timeline.ticks)
    np.testing.assert_array_equal(short.motor_stands(of_same), stands)
    np.testing.assert_array_equal(short.dynamics.steps.at_ticks[of_same], problem.dynamics.steps.at_ticks)
