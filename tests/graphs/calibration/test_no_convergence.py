# SPDX-License-Identifier: BSD-3-Clause
"""A search that does not end names the effects whose sizes go to nothing, with the command that removes them."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from jointscope.graphs.calibration.stages.convergence_asked import must_converge
from jointscope.graphs.solving.convergence import Iteration
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot


def unfinished(robot, sizes):
    values = {name: parameter.value for name, parameter in robot.parameters.items()} | sizes
    calibration = SimpleNamespace(by_name=values)
    estimate = SimpleNamespace(calibrations=(calibration,))
    return SimpleNamespace(converged=False, flat=False, iterations=[Iteration(9.0, 8.0, 1.0, 0.9)], estimate=estimate)


def test_effects_that_vanish_are_named_with_the_command_that_removes_them():
    robot = add_effect(load_robot("doggy"), "backlash@joint2")
    small = 0.01 * robot.parameters["joint2.backlash.half_gap"].prior
    with pytest.raises(SolveError, match=r"sizes of backlash@joint2 are below a tenth .*jointscope remove doggy back"):
        must_converge(unfinished(robot, {"joint2.backlash.half_gap": small}), robot, 0.1)


def test_effects_that_are_there_are_not_blamed():
    robot = add_effect(load_robot("doggy"), "backlash@joint2")
    with pytest.raises(SolveError, match="no convergence after 1 iterations") as err:
        must_converge(unfinished(robot, {}), robot, 0.1)
    assert "remove" not in str(err.value)
