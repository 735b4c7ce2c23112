# SPDX-License-Identifier: BSD-3-Clause
"""Calibrations with late stamps begin near the right delay, however many samples it is."""

from __future__ import annotations

import pytest

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.graphs.starts.time_shift_start import with_best_shifts
from jointscope.robots.files.effect_editing import add_effect

pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")


def recording(doggy, effect, seconds=4.0):
    from jointscope.tools.simulator import simulate

    return simulate(doggy, "calibration", seconds, seed=12, friction="smooth", effects=[effect]).recording


@pytest.mark.slow
def test_a_gyro_that_is_many_samples_late_is_calibrated_from_the_null_model(doggy):
    """From the start value of a millisecond this ran into bent states, and ended with an error."""
    late = recording(doggy, "gyro_delay@imu1:delay=0.006")
    result = calibrate(add_effect(doggy, "gyro_delay@imu1"), [late])
    delay = result.robot.parameters["imu1.gyro_delay.delay"]
    assert result.converged and delay.value == pytest.approx(0.006, abs=max(3.0 * delay.sigma, 2e-5))


def started(robot, data, hold=()):
    problem = BagProblem.of(robot, data)
    calibration = Calibration.of(robot)
    estimate = Estimate((initial_states(problem, calibration),), (calibration,))
    return problem, estimate, with_best_shifts([problem], estimate, hold)


@pytest.mark.slow
def test_offsets_are_found_on_either_side(doggy):
    robot = add_effect(doggy, "clock_offset@imu2")
    _, _, (problems, estimate) = started(robot, recording(doggy, "clock_offset@imu2:offset=-0.004"))
    found = dict(zip(estimate.calibrations[0].names, estimate.calibrations[0].values, strict=True))
    assert found["imu2.clock_offset.offset"] == pytest.approx(-0.004, abs=1e-3)
    assert problems[0].robot.parameters["imu2.clock_offset.offset"].value == found["imu2.clock_offset.offset"]


def test_without_shifts_or_with_parameters_held_nothing_is_done(doggy, simulated):
    part = simulated.recording.between(0.0, 3.0)
    problem, estimate, (problems, same) = started(doggy, part)
    assert problems == [problem] and same is estimate
    problem, estimate, (problems, same) = started(add_effect(doggy, "gyro_delay@imu1"), part, hold=(DYNAMICS,))
    assert problems == [problem] and same is estimate
