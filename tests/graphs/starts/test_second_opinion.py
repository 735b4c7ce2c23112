# SPDX-License-Identifier: BSD-3-Clause
"""Regression beside a calibration: silent where they agree or it does not apply, a sentence elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slow_pendulum import TRUTH, pendulum, recorded, swing

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.starts.second_opinion import regressed_values
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.verdicts.judgement import judge

VISCOUS = "swing.motor_viscous.coefficient"


@pytest.fixture(scope="module")
def recording():
    """Commands that act until the next one."""
    stamps, currents, angles = swing(6.0, 100.0)
    return recorded(stamps, currents, angles + 1e-5 * np.random.default_rng(7).standard_normal(angles.shape))


@pytest.fixture(scope="module")
def calibrated(recording, tmp_path_factory):
    return calibrate(pendulum(tmp_path_factory.mktemp("pendulum"), 1e-5), [recording])


def second_opinion(result):
    return next(check for check in judge(result).checks if check.name == "Regression says the same")


def test_both_ways_end_at_the_truth(calibrated):
    assert set(calibrated.regressed) == set(TRUTH)
    for name, value in calibrated.regressed.items():
        assert value.value == pytest.approx(TRUTH[name], rel=0.02)
    assert second_opinion(calibrated).level == "good"


def test_a_value_that_regression_contradicts_is_said_with_both_numbers(calibrated):
    wrong = tuple(replace(p, value=0.53, sigma=0.02) if p.name == VISCOUS else p for p in calibrated.parameters)
    check = second_opinion(replace(calibrated, parameters=wrong))
    assert check.level == "warn"
    assert f"{VISCOUS} is 0.530 ± 0.02 N m s/rad here" in check.text and "by regression" in check.text
    assert "one of the two is wrong" in check.text


def test_a_small_share_or_a_few_sigmas_are_no_contradiction(calibrated):
    for value, sigma in ((0.408, 1e-6), (0.6, 0.1)):
        near = tuple(replace(p, value=value, sigma=sigma) if p.name == VISCOUS else p for p in calibrated.parameters)
        assert second_opinion(replace(calibrated, parameters=near)).level == "good"


def test_a_delay_of_the_commands_is_taken_into_account(tmp_path, recording):
    robot = add_effect(pendulum(tmp_path, 1e-5), "command_delay@robot", {"delay": 3e-3})
    command = recording.streams["command"]
    early = replace(command, times=command.times - 3e-3)
    found = regressed_values(robot, [replace(recording, streams={**recording.streams, "command": early})])
    assert found[VISCOUS].value == pytest.approx(TRUTH[VISCOUS], rel=0.02)


def test_where_regression_does_not_apply_it_says_nothing(tmp_path, recording, calibrated):
    elastic = load_robot("doggy")
    assert regressed_values(elastic, [recording]) == {}
    assert regressed_values(add_effect(pendulum(tmp_path, 1e-5), "cogging@swing"), [recording]) == {}
    noise = 0.5 * np.random.default_rng(8).standard_normal((600, 1))
    command = recording.streams["command"]
    other = replace(command, values=command.values[::-1] + noise)
    unexplained = replace(recording, streams={**recording.streams, "command": other})
    assert regressed_values(pendulum(tmp_path, 1e-5), [unexplained]) == {}
    assert second_opinion(replace(calibrated, regressed={})).level == "info"
