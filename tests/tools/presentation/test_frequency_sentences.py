# SPDX-License-Identifier: BSD-3-Clause
"""What is said of friction that turns over faster than velocities tell."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.presentation.frequency_sentences import identifiable_sentence, sticking

NAMES = ("joint1.friction_sharpness", "joint2.friction_sharpness", "joint2.stiffness", "joint2.damping", "joint3.lx")


def found(*sigmas):
    """A result with these sigmas of logarithms, and of a length."""
    robot = load_robot("tx90l")
    springs = [SimpleNamespace(stiffness="joint2.stiffness", damping="joint2.damping")]
    problem = SimpleNamespace(arm=SimpleNamespace(springs=springs))
    covariance = np.diag(np.square(sigmas))
    return FrequencyCalibration(robot, robot, (problem,), NAMES, covariance, 1, 1, 0.0, 0.0, None)


def test_sharpness_that_is_known_says_nothing_and_all_springs_are_identifiable():
    result = found(0.02, 0.05, 0.01, 0.09, 1e-6)
    assert sticking(result) == [] and result.told == NAMES
    assert identifiable_sentence(result) == "all springs and dampers are identifiable"


def test_joints_whose_friction_may_stick_are_named():
    (sentence,) = sticking(found(0.02, 0.4, 0.01, 0.01, 1e-6))
    assert sentence.startswith("friction of joint2 turns over faster") and "further off than their sigmas" in sentence


@pytest.mark.parametrize("sigma", [0.11, 0.3])
def test_a_damper_that_is_known_to_less_than_a_tenth_is_not_identifiable(sigma):
    result = found(0.02, 0.02, 0.01, sigma, 1e-6)
    assert result.silent == ("joint2.damping",)
    assert identifiable_sentence(result) == "not identifiable from these poses: joint2.damping"


def test_a_value_that_its_prior_told_as_well_is_not_told_however_small_its_sigma_is():
    robot = load_robot("tx90l")
    p = robot.parameters["joint2.damping"]
    tight = replace(robot, parameters={**robot.parameters, p.name: replace(p, prior_sigma=0.05 * p.prior)})
    result = replace(found(0.02, 0.02, 0.01, 0.04, 1e-6), robot=tight)
    assert result.silent == ("joint2.damping",)
