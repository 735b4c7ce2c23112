# SPDX-License-Identifier: BSD-3-Clause
"""Robots of every sort, with every sensor: a factor for every sample, condensed factors and the band cost the same."""

from dataclasses import replace

import numpy as np
import pytest
from linearised_motion import ROBOTS, motion

from jointscope.factors.calibration import Calibration
from jointscope.graphs.gtsam_solvers.reference_graph import initial_values, nonlinear_graph
from jointscope.graphs.gtsam_solvers.samples_solver import solve_samples
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import solve, total_cost
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream

READY = {name: load_robot(name) for name in ("biorob", "doggy_paper", "xl330_pendulum")}
SECONDS = 0.06


def recorded(robot):
    """A recording of noise about a smooth motion, and that motion."""
    ticks, rng, n = 1.0 + np.arange(0.0, SECONDS, 2e-3), np.random.default_rng(3), robot.n
    u = 0.3 * np.sin(2.0 * np.pi * ticks[:, None] * (1.0 + 0.4 * np.arange(n)) + 0.3)
    streams = {"command": Stream("command", ticks, u, tuple(f"{j}.command" for j in robot.joints), "1")}
    for k, (name, sensor) in enumerate(robot.sensors.items()):
        values = 0.1 * rng.normal(size=(len(ticks), len(sensor.channels)))
        if sensor is robot.motor_encoder:
            values = motion(robot, ticks)[:, robot.layout.motor_q] + 1e-4 * rng.normal(size=values.shape)
        streams[name] = Stream(name, ticks + 4e-4 * (k % 2), values, sensor.channels, "")
    problem = BagProblem.of(robot, Recording("", "", 0, streams))
    return problem, Estimate((motion(robot, problem.timeline.ticks),), (Calibration.of(robot),))


@pytest.mark.parametrize("name", [*ROBOTS, *READY])
def test_costs_agree(name):
    problem, estimate = recorded({**ROBOTS, **READY}[name])
    whole = total_cost([problem], estimate)
    graph, values = CondensedGraph.of([problem], estimate, length=10)
    assert graph.cost(values) == pytest.approx(whole, rel=1e-9)
    assert nonlinear_graph([problem], estimate).error(initial_values(estimate)) == pytest.approx(whole, rel=1e-9)


@pytest.mark.slow
def test_coupled_joints_with_encoders_on_both_sides_have_the_minimum_that_gtsam_finds():
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    robot = load_robot("biorob")
    robot = replace(robot, choices=replace(robot.choices, friction_sharpness=5.0))  # soft: one minimum
    recording = simulate(robot, "calibration", 3.0, seed=1, friction="smooth").recording.between(2.0, 2.1)
    problem, calibration = BagProblem.of(robot, recording), Calibration.of(robot)
    start = Estimate((initial_states(problem, calibration),), (calibration,))
    fast = solve([problem], start, max_iterations=200, step_tolerance=1e-6)
    slow = solve_samples([problem], start)
    # a tenth of a second determines little: the long valley is walked to its end by one from where the other stopped
    assert 0.0 <= fast.cost - slow.cost < 0.02
    assert solve_samples([problem], fast.estimate).cost == pytest.approx(slow.cost, rel=1e-8)
    there = solve([problem], slow.estimate, max_iterations=200, step_tolerance=1e-6)
    assert there.cost == pytest.approx(slow.cost, rel=1e-8)
    sigma = np.sqrt(np.diag(posteriors([problem], there)[1]))
    apart = np.abs(there.estimate.calibrations[0].dynamics - slow.estimate.calibrations[0].dynamics)
    assert np.max(apart / sigma[: len(apart)]) < 1e-2
