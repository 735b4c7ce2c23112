# SPDX-License-Identifier: BSD-3-Clause
"""Springs follow friction to its mean where links rest as they were seen, not along a tangent."""

from __future__ import annotations

import numpy as np
import pytest
from lever_bench import K, hanging, lever

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_sets.rest_errors import rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.graphs.rests.followers import with_followers


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """Robot, rests with their weights, states and values where they are likeliest."""
    robot = lever(tmp_path_factory.mktemp("lever"))
    result = calibrate_rests(robot, [hanging(60, 1)])
    return robot, RestSet.joined(result.problems), np.concatenate(result.states), result.likeliest


def moved(robot, factors):
    """The values of a robot, some of them by a factor."""
    return Calibration.of(robot.with_values({n: f * robot.values[n] for n, f in factors.items()})).only([DYNAMICS])


def test_springs_off_the_curve_come_back_and_friction_stays_at_its_mean(solved):
    robot, whole, x, likeliest = solved
    mean = moved(likeliest, {"swing.coulomb_torque": 1.05, "swing.stiffness": 1.4})
    before = rest_errors([whole.of_robot(robot.with_values(mean.by_name))]).error
    found = with_followers(whole, robot, x, moved(likeliest, {}), mean)
    after = rest_errors([whole.of_robot(robot.with_values(found.by_name))]).error
    assert before > 50.0 and after < 1.3
    assert found.by_name["swing.coulomb_torque"] == pytest.approx(mean.by_name["swing.coulomb_torque"])
    assert found.by_name["swing.stiffness"] == pytest.approx(K, rel=0.01)


def test_means_at_which_links_rest_as_well_stay(solved):
    robot, whole, x, likeliest = solved
    mean = moved(likeliest, {"swing.coulomb_torque": 1.05, "swing.stiffness": 1.0005})
    assert with_followers(whole, robot, x, moved(likeliest, {}), mean) is mean
