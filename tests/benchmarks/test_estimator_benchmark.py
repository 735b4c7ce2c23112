# SPDX-License-Identifier: BSD-3-Clause
"""The pieces of the estimator's benchmark: what the estimator is held against must be right itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from estimator_case import make_case
from estimator_run import Judged
from kalman_filter import filtered
from message_feed import cycles, disturbed, in_order
from plain_smoother import PlainSmoother

from jointscope.graphs.comparison.causal_filter import filter_around
from jointscope.graphs.comparison.compare import smooth
from jointscope.graphs.fixed_lag import EstimatedState

SILENT = ("imu2", 0.2, 0.6)


@pytest.fixture(scope="module")
def case():
    return make_case(3, 1.2, quantized=False)  # how coarse an encoder is, the batch tells from the whole recording


@pytest.fixture(scope="module")
def messages(case):
    return in_order(case.recording)


def beginning(recording, seconds):
    return replace(recording, streams={name: s.between(0.0, seconds) for name, s in recording.streams.items()})


@pytest.mark.slow
def test_the_kalman_filter_agrees_with_the_filter_behind_compare(case):
    problem, states, calibration = smooth(case.robot, case.recording)
    causal = filter_around(problem, states, calibration)
    known = {g.name: replace(g, bias=calibration.biases[g.name], bias_prior_sigma=1e-7) for g in case.robot.gyros}
    times, mean = filtered(case.robot.with_sensors(known), case.recording, like_ours=False)
    late = times > 0.8
    own = np.searchsorted(problem.timeline.ticks, times[late] - 1e-6)
    sigma = np.sqrt(np.einsum("kii->ki", causal.covariance[own]))
    z = (mean[late] - causal.mean[own]) / sigma
    assert np.sqrt(np.mean(z**2)) < 0.1 and np.abs(z).max() < 0.5


def test_the_plain_smoother_follows_the_robot(case):
    short = beginning(case.recording, 0.15)
    plain = PlainSmoother(case.robot, short, 0.05)
    x = plain.newest
    for _ in range(150):
        x = plain.advance()
    error = case.robot.layout.by_joint(x) - case.truth(np.array([0.149]))[0]
    assert np.abs(error[:3]).max() < 1e-3
    assert np.abs(error[3:6]).max() < 0.05


def test_every_message_reaches_the_controller_once_and_commands_come_after_their_samples(messages):
    ran = list(cycles(messages))
    assert [m for _, arrived in ran for m in arrived] == messages
    assert np.allclose(np.diff([t for t, _ in ran]), 1e-3)
    assert [m.stream for m in ran[7][1]][-1] == "command" and len(ran[7][1]) == 4


def test_a_bad_day_loses_what_it_says_and_keeps_every_stamp(messages):
    left = disturbed(messages, np.random.default_rng(0), lost=0.3, latest=5e-3, silent=SILENT)
    silent = [m for m in messages if m.stream == SILENT[0] and SILENT[1] <= m.stamp < SILENT[2]]
    assert len(left) / (len(messages) - len(silent)) == pytest.approx(0.7, abs=0.03)
    assert not [m for m in left if m.stream == SILENT[0] and SILENT[1] <= m.stamp < SILENT[2]]
    delays = np.array([m.arrives - m.stamp for m in left])
    assert delays.min() >= 0.0 and 4.9e-3 < delays.max() <= 5e-3
    assert np.any(np.diff([m.stamp for m in left if m.stream == "imu1"]) < 0.0)


def test_nees_is_one_for_errors_that_are_drawn_from_the_covariance(case):
    layout, rng = case.robot.layout, np.random.default_rng(1)
    root = np.diag(np.r_[np.full(6, 1e-4), np.full(6, 1e-2)]) @ rng.standard_normal((12, 12))
    times = np.arange(1, 1001) * 1e-3
    truth = case.robot.layout.from_joints(case.truth(times))
    states = [
        EstimatedState(float(t), x + root @ rng.standard_normal(12), root @ root.T, 0.0, layout)
        for t, x in zip(times, truth, strict=True)
    ]
    assert Judged.of(case, case.robot, states).nees.mean() == pytest.approx(1.0, abs=0.05)
