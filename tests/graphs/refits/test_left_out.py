# SPDX-License-Identifier: BSD-3-Clause
"""Refits asked early whether they help elsewhere: on an arm whose cables pull it back, which its model does not know.

The arm is simulated with a law of its own, cut in pieces to fit and pieces that are left out.
"""

from __future__ import annotations

from dataclasses import replace

import pytest
from simulated_arm import Arm, moved, robot_file

from jointscope.factors.calibration import DYNAMICS
from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.refits.left_out import FAR, LeftOut, Missed
from jointscope.graphs.refits.refit import BegunRefit, refit
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording

ARM = Arm("yx", inertia=(0.7, 0.2), dry=(2.0, 0.8), viscous=(1.5, 0.6))
CABLE, TRUE = 30.0, "parallel_spring@j0"  # [N m/rad]
STIFFNESS = "j0.parallel_spring.stiffness"


@pytest.fixture(scope="module")
def blind(tmp_path_factory):
    """The model without cables, and what its refits leave out."""
    encoder, command = moved(ARM, seconds=5.0, cable=CABLE)
    recordings = [Recording("cable.mcap", "", 10**18, {"encoder": encoder, "command": command})]
    robot = load_robot(robot_file(ARM, tmp_path_factory.mktemp("arm")))
    base = BaseModel.of(robot, recordings, by_torques=False)
    fit, left = base.spans()
    return base, fit, LeftOut.of(base, (fit, left))


def with_stiffness(begun, value, converged):
    """The refit as if its iterations had ended elsewhere."""
    found = begun.solution.estimate
    place = found.calibrations[0].names.index(STIFFNESS)
    points = found.calibrations[0].points[DYNAMICS].copy()
    points[place] = value / found.calibrations[0].value_by_coordinate[place]
    calibrations = tuple(c.with_points({DYNAMICS: points}) for c in found.calibrations)
    return replace(
        begun, solution=replace(begun.solution, estimate=Estimate(found.states, calibrations), converged=converged)
    )


def test_an_effect_that_is_there_makes_what_is_left_out_likelier(blind):
    base, fit, left_out = blind
    begun = BegunRefit.of(base, fit, None, TRUE)
    assert left_out.times(begun) < 1.0
    assert left_out.asked(begun) is begun
    whole = refit(base, fit, None, TRUE)
    assert abs(whole.robot.values[STIFFNESS] - CABLE) < max(3.0 * whole.sigmas["stiffness"], 0.05 * CABLE)


def test_the_model_without_an_effect_that_is_fitted_to_the_same_pieces_is_the_measure(blind):
    base, fit, left_out = blind
    assert left_out.times(BegunRefit.of(base, fit, None)) == pytest.approx(1.0, rel=1e-9)


def test_values_that_have_come_to_rest_far_off_are_given_up(blind):
    base, fit, left_out = blind
    off = with_stiffness(BegunRefit.of(base, fit, None, TRUE), -40.0 * CABLE, converged=True)
    missed = left_out.asked(off)
    assert isinstance(missed, Missed) and missed.converged
    assert missed.times >= FAR


def test_a_true_effect_that_began_far_off_is_given_time_and_kept(blind):
    base, fit, left_out = blind
    begun = BegunRefit.of(base, fit, None, TRUE)
    late = with_stiffness(begun, -40.0 * CABLE, converged=False)
    assert left_out.times(late) >= FAR  # it would be given up
    kept = left_out.asked(late)
    assert isinstance(kept, BegunRefit)
    found = kept.solution.estimate.calibrations[0]
    assert found.values[found.names.index(STIFFNESS)] == pytest.approx(CABLE, rel=0.1)
