# SPDX-License-Identifier: BSD-3-Clause
"""Consistency of a replay has two sides: sigmas that are too narrow are a doubt, too wide ones a remark."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.fixed_lag.replay.nis_windows import nis_bounds
from jointscope.graphs.fixed_lag.replay.replay_result import InnovationSeries
from jointscope.tools.verdicts.replay_judgement import judge_replay


def series(true_over_stated: float, count: int = 3000, alike: int = 1) -> InnovationSeries:
    """Innovations of one channel whose errors are so many times their sigma, with runs of equal ones."""
    errors = true_over_stated * np.repeat(np.random.default_rng(1).standard_normal(count // alike), alike)
    nis, one = errors**2, np.ones(len(errors))
    return InnovationSeries(
        ("joint1.motor_position",),
        ("rad",),
        np.arange(len(errors)) * 1e-3,
        errors[:, None],
        one[:, None],
        nis,
        one,
        one > 0,
        float(nis.mean()),
        float(len(errors)),
        {"joint1.motor_position": float(nis.mean())},
        len(errors),
    )


def check(**sensors):
    """The check of consistency, of a replay in which all else is good."""
    total = sum(s.dof_sum for s in sensors.values())
    result = SimpleNamespace(
        innovations=sensors,
        nis_mean=sum(s.nis_mean * s.dof_sum for s in sensors.values()) / total,
        alarms={},
        status=SimpleNamespace(alarms=(), received={}, late={}, dropped={}),
        dropped=0,
        events=[],
        latency=SimpleNamespace(p50=1e-4, p99=2e-4, max=3e-4, mean=1e-4),
        recording_seconds=3.0,
        updates=3000,
        agreement=None,
        no_agreement="",
        robot=SimpleNamespace(path=Path("arm.yaml")),
    )
    return judge_replay(result).checks[0]


def test_a_consistent_replay_is_good_and_says_what_chance_allows():
    found = check(motor_encoder=series(1.0), imu1=series(1.05))
    assert found.level == "good" and "by chance)" in found.text and "Sigmas of" not in found.text


def test_wide_sigmas_of_one_sensor_are_a_remark_with_what_to_do_although_the_mean_is_right():
    found = check(motor_encoder=series(0.7), imu1=series(1.1, 9000))
    assert found.level == "info"
    assert "Sigmas of motor_encoder are 1.4 times as wide as its errors" in found.text
    assert "sensors.motor_encoder in arm.yaml" in found.text and "noise: {estimate: true}" in found.text


def test_narrow_sigmas_are_a_doubt():
    assert check(motor_encoder=series(1.3)).level == "warn"
    assert check(motor_encoder=series(1.6)).level == "bad"


@pytest.mark.parametrize(("count", "alike"), [(40, 1), (600, 15)])
def test_few_innovations_or_neighbours_that_are_alike_prove_nothing(count, alike):
    low, high = nis_bounds(series(1.0, count, alike))
    assert low < 0.6 and high > 1.45
    plenty = nis_bounds(series(1.0, 6000))
    assert 0.9 < plenty[0] < 1.0 < plenty[1] < 1.1
