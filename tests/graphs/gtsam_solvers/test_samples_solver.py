# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` against the graph with a factor for every sample, solved by GTSAM's own optimizer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.factors.priors import DynamicsPrior
from jointscope.factors.single import single_factor
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.gtsam_solvers.reference_graph import initial_values, nonlinear_graph
from jointscope.graphs.gtsam_solvers.samples_solver import solve_samples
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import total_cost
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.robots.errors import SolveError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording

SHARED = Path(__file__).resolve().parents[3].parent / "shared"


@pytest.fixture(scope="module")
def pendulum():
    """A real servo whose encoder counts; dry friction that bends slowly has one minimum in spite of it."""
    bag = SHARED / "data" / "real" / "bam_xl330" / "kp400_sin_sin"
    if not bag.is_dir():
        pytest.skip("shared/data/real is not beside the project: recordings of real robots cannot be tested")
    robot = load_robot("xl330_pendulum")
    known = replace(robot.noise, estimate=False)
    robot = replace(robot, choices=replace(robot.choices, friction_sharpness=3.0), noise=known)
    return robot, read_recording(bag, robot).between(1.0, 1.6)


def test_calibrate_ends_where_gtsams_optimizer_ends_on_a_factor_for_every_sample(pendulum):
    robot, recording = pendulum
    condensed, plain = (calibrate(robot, [recording], **how) for how in ({}, {"solver": solve_samples}))
    assert plain.converged
    assert plain.cost == pytest.approx(condensed.cost, rel=1e-6)
    # the batch is content where the next step is short: of values that are known badly that is a hundredth of a sigma
    for one, other in zip(condensed.parameters, plain.parameters, strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-2 * one.sigma), one.name
        assert one.sigma == pytest.approx(other.sigma, rel=1e-2), one.name


def test_a_recording_that_is_too_long_for_a_factor_for_every_sample_is_refused_with_what_it_would_cost(simulated):
    wanted = r"8,000 states and 32,\d+ samples are too many for `--solver samples`: about \d+ .* leave the option out"
    with pytest.raises(SolveError, match=wanted):
        calibrate(load_robot("doggy"), [simulated.recording], solver=solve_samples)


def test_sigmas_of_a_nanometre_are_no_constraints(simulated):
    """GTSAM takes a sigma below 1e-8 for exact; positions in a step of a millisecond are as certain."""
    robot = load_robot("doggy")
    tight = replace(robot.noise, link_velocity=np.full(3, 1e-3), motor_velocity=np.full(3, 1e-3))
    problem = BagProblem.of(replace(robot, noise=tight), simulated.recording.between(4.0, 4.02))
    calibration = Calibration.of(robot)
    estimate = Estimate((initial_states(problem, calibration),), (calibration,))
    assert np.min(problem.dynamics.sigmas) < 1e-8
    graph, values = nonlinear_graph([problem], estimate), initial_values(estimate)
    assert not any(graph.at(i).noiseModel().isConstrained() for i in range(graph.size()))
    assert graph.error(values) == pytest.approx(total_cost([problem], estimate), rel=1e-9)


def test_a_sigma_of_zero_is_an_error_that_says_what_to_write_instead():
    robot = load_robot("doggy")
    prior = DynamicsPrior.of(robot)
    exact = replace(prior, sigma=np.where(np.arange(len(prior.sigma)) == 6, 0.0, prior.sigma))
    with pytest.raises(SolveError, match=r"sigma of joint1\.stiffness\.prior is 0; .* `fixed: true` in the robot file"):
        single_factor(exact, 0, (), Calibration.of(robot))


def test_blocks_that_are_held_are_no_variables_and_stay(simulated):
    robot = load_robot("doggy")
    problem = BagProblem.of(robot, simulated.recording.between(4.0, 4.02))
    calibration = Calibration.of(robot)
    start = Estimate((initial_states(problem, calibration),), (calibration,))
    held = ("dynamics", "imu1.rotation", "imu2.rotation")
    solution = solve_samples([problem], start, max_iterations=3, hold=held)
    found = solution.estimate.calibrations[0]
    assert np.array_equal(found.dynamics, calibration.dynamics)
    assert np.array_equal(found.rotations["imu2"], calibration.rotations["imu2"])
    assert not np.array_equal(found.biases["imu2"], calibration.biases["imu2"])
    assert solution.cost < total_cost([problem], start)
