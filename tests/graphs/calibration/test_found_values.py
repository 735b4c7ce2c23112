# SPDX-License-Identifier: BSD-3-Clause
"""Values that ran into the bound of their range, or beyond it, are marked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.graphs.calibration.found_values import (
    AT_BOUND,
    NEAR_BOUND,
    STAMPED_LATE,
    WRONG_SIDE,
    dynamic_parameters,
    share_of_value,
)
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot

ROBOT = add_effect(load_robot("doggy"), "motor_viscous@joint1")
FRICTION, VISCOUS = "joint1.coulomb_torque", "joint1.motor_viscous.coefficient"


def note_of(name: str, value: float, sigma: float, of: Robot = ROBOT) -> str:
    """The note of one parameter with a value and a standard deviation, both in its unit."""
    robot = replace(of, parameters={**of.parameters, name: replace(of.parameter(name), value=value)})
    calibration = Calibration.of(robot)
    sigmas = np.full(len(calibration.names), 1e-4)
    place = calibration.names.index(name)
    sigmas[place] = sigma / calibration.value_by_coordinate[place]
    return next(p.note for p in dynamic_parameters(of, calibration, sigmas) if p.name == name)


@pytest.mark.parametrize(
    "share, relative, note",
    [(1.0, 0.01, ""), (0.05, 0.01, ""), (0.05, 0.9, AT_BOUND), (0.3, 0.65, NEAR_BOUND), (1e-6, 50.0, AT_BOUND)],
)
def test_a_positive_value_that_may_be_zero_says_so(share, relative, note):
    prior = ROBOT.parameter(FRICTION).prior
    assert note_of(FRICTION, share * prior, relative * share * prior) == note


def test_a_value_that_fell_to_its_bound_has_no_smaller_sigma_than_at_its_prior():
    calibration = Calibration.of(
        replace(ROBOT, parameters={**ROBOT.parameters, FRICTION: replace(ROBOT.parameter(FRICTION), value=1e-4)})
    )
    sigmas = np.full(len(calibration.names), 2.0)
    found = next(p for p in dynamic_parameters(ROBOT, calibration, sigmas) if p.name == FRICTION)
    assert found.note == AT_BOUND
    assert found.sigma == pytest.approx(2.0 * ROBOT.parameter(FRICTION).prior)


@pytest.mark.parametrize("value, sigma, note", [(0.4, 0.01, ""), (-0.01, 0.01, ""), (-0.4, 0.01, WRONG_SIDE)])
def test_a_friction_that_drives_is_marked(value, sigma, note):
    assert note_of(VISCOUS, value, sigma) == note


@pytest.mark.parametrize("held, note", [(True, WRONG_SIDE), (False, f"{STAMPED_LATE}, by 10 ms")])
def test_only_of_a_measured_drive_signal_a_delay_below_zero_has_a_meaning(held, note):
    robot = add_effect(ROBOT, "command_delay@robot")
    robot = replace(robot, command=replace(robot.command, held=held))
    assert note_of("robot.command_delay.delay", -0.01, 1e-5, robot) == note
    assert note_of("robot.command_delay.delay", -1e-5, 1e-5, robot) == ""


def test_a_share_is_told_of_values_that_differ_from_zero_or_are_not_known():
    def share(value, sigma, prior_sigma=1.0, name="imu1.bias.x"):
        return share_of_value(ROBOT, ParameterEstimate(name, value, sigma, "1", 0.0, 0.0, prior_sigma, None))

    assert share(1e-3, 4e-4) == pytest.approx(0.4)
    assert share(1.3e-4, 1.2e-4) is None
    assert share(1e-3, 0.9) == pytest.approx(900.0)
    assert share(1e-3, 8e-4, name="joint1.damping") == pytest.approx(0.8)
