# SPDX-License-Identifier: BSD-3-Clause
"""The score test against brute force: dense normal equations with all states, and recordings with a known truth."""

from __future__ import annotations

import numpy as np
import pytest
from linearised_motion import base

from jointscope.factors.dynamics import DynamicsFactor
from jointscope.factors.priors import shared_priors
from jointscope.graphs.discovery.scored_candidates import _placebos
from jointscope.graphs.scoring.columns import score_signals
from jointscope.graphs.scoring.columns.hypotheses import hypotheses_of
from jointscope.graphs.scoring.columns.score_signals import ScoreSignals
from jointscope.graphs.scoring.order_scan import scan_orders
from jointscope.graphs.scoring.score_columns import regressors_of
from jointscope.graphs.scoring.score_system import Segment, rows_of
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.normal_equations import accumulate, whitened

TRIED = ("motor_viscous@joint2", "cogging@joint1", "motor_lag@joint3", "gyro_scale@imu2", "encoder_delay@robot")


def hypotheses(robot, labels):
    """The first hypothesis of each label."""
    found = {}
    for hypothesis in hypotheses_of(robot):
        found.setdefault(hypothesis.label, hypothesis)
    return [found[label] for label in labels]


@pytest.fixture(scope="module")
def short():
    """Sixty milliseconds: 61 states of 12 fit into a dense matrix."""
    segment, x = base("doggy", seconds=0.06)
    return segment, x


def test_signals_of_some_ticks_at_a_time_are_those_of_all(short, monkeypatch):
    segment, x = short
    asked = (segment.problem, x, segment.calibration)
    whole, (middle, by_rates) = ScoreSignals.of(*asked), ScoreSignals.between(*asked)
    monkeypatch.setattr(score_signals, "CHUNK", 7)
    parts, (middle_parts, by_rates_parts) = ScoreSignals.of(*asked), ScoreSignals.between(*asked)
    np.testing.assert_array_equal(by_rates_parts, by_rates)
    for one, other in ((parts, whole), (middle_parts, middle)):
        for name in ("a_link", "M_inverse", "response"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def dense(segment, x, hypothesis):
    """Hessian and gradient on (states, shared values, sizes), every residual row by row, with all priors."""
    d, k = x.shape[1], len(hypothesis.sizes)
    columns = segment.calibration.columns
    p = max(c.stop for c in columns.values())
    rows = rows_of(segment, regressors_of(hypothesis, segment))
    touched = [f for f, _, _ in segment.linearized if f.states and f.name != "initial_state"]
    touched = touched if len(rows) == len(touched) else [f for f in touched if isinstance(f, DynamicsFactor)]
    by_size = {id(f): part.by_size for f, part in zip(touched, rows, strict=True)}
    blocks, residuals = [], []
    for factor, ticks, linear in segment.linearized:
        r, J, by_block = whitened(factor, linear)
        A = np.zeros((*r.shape, x.size + p + k))
        for s in range(len(r)):
            for i, J_i in enumerate(J):
                A[s, :, (ticks[s] + i) * d : (ticks[s] + i + 1) * d] += J_i[s]
            for block, J_b in by_block.items():
                start = x.size + columns[block].start
                A[s, :, start : start + J_b.shape[2]] += J_b[s]
            if id(factor) in by_size:
                A[s, :, x.size + p :] += by_size[id(factor)][s]
        blocks.append(A.reshape(-1, A.shape[2]))
        residuals.append(r.ravel())
    for prior in shared_priors(segment.problem.robot):
        linear = prior.linearize((), segment.calibration)
        r, _, by_block = whitened(prior, linear)
        A = np.zeros((r.size, x.size + p + k))
        for block, J_b in by_block.items():
            A[:, x.size + columns[block].start : x.size + columns[block].stop] += J_b[0]
        blocks.append(A)
        residuals.append(r.ravel())
    for i, size in enumerate(hypothesis.sizes):
        A = np.zeros((1, x.size + p + k))
        A[0, x.size + p + i] = 1.0 / size.prior_sigma
        blocks.append(A)
        residuals.append(np.zeros(1))
    return np.vstack(blocks), np.concatenate(residuals), x.size + p


@pytest.mark.parametrize("label", TRIED)
def test_scores_after_elimination_equal_least_squares_with_all_states(short, label):
    """Projecting on what states and base parameters leave of a regressor is the same as eliminating them."""
    segment, x = short
    (hypothesis,) = hypotheses(segment.problem.robot, [label])
    (score,) = ScoreTest([segment]).each([hypothesis])
    A, r, n = dense(segment, x, hypothesis)
    scale = 1.0 / np.maximum(np.linalg.norm(A[:, :n], axis=0), 1e-300)
    Q, R = np.linalg.qr(A[:, :n] * scale)
    assert np.abs(np.diag(R)).min() > 1e-9
    left, r_left = A[:, n:] - Q @ (Q.T @ A[:, n:]), r - Q @ (Q.T @ r)
    S, s = left.T @ left, left.T @ r_left
    np.testing.assert_allclose(score.S, S, rtol=1e-5, atol=1e-7 * np.abs(S).max())
    np.testing.assert_allclose(score.estimate, -np.linalg.solve(S, s), rtol=1e-4)
    assert score.score == pytest.approx(s @ np.linalg.solve(S, s), rel=1e-4)
    np.testing.assert_allclose(score.sigma, np.sqrt(np.diag(np.linalg.inv(S))), rtol=1e-4)


def test_the_estimate_is_minus_S_inverse_s_and_the_score_its_square(short):
    segment, _ = short
    for score in ScoreTest([segment]).each(hypotheses(segment.problem.robot, TRIED)):
        np.testing.assert_allclose(score.S @ score.estimate, -score.s, rtol=1e-6, atol=1e-9 * np.abs(score.s).max())
        assert score.score == pytest.approx(score.estimate @ score.S @ score.estimate, rel=1e-6)


def test_hypotheses_scored_together_score_as_they_do_alone(short):
    segment, _ = short
    test, chosen = ScoreTest([segment]), hypotheses(segment.problem.robot, TRIED)
    for alone, together in zip(test.each(chosen), test.together(chosen).scores, strict=True):
        assert together.score == pytest.approx(alone.score, rel=1e-6)
        np.testing.assert_allclose(together.estimate, alone.estimate, rtol=1e-6)


def test_the_evidence_of_two_segments_is_added(long):
    """Priors count once however many segments there are, so it is at most twice that of one."""
    segment, _ = long
    chosen = hypotheses(segment.problem.robot, ["motor_viscous@joint2", "gyro_scale@imu2"])
    one, two = (ScoreTest([segment] * count).each(chosen) for count in (1, 2))
    assert one[0].S[0, 0] < two[0].S[0, 0] <= 2.0 * one[0].S[0, 0]
    np.testing.assert_allclose(two[1].S, 2.0 * one[1].S, rtol=0.1, atol=0.02 * one[1].S.max())


def with_residual_of(segment, x, hypothesis, amount):
    """The segment as if the recording held `amount` of a hypothesis: its regressor is taken off every residual."""
    rows = rows_of(segment, regressors_of(hypothesis, segment))
    touched = [i for i, (f, _, _) in enumerate(segment.linearized) if isinstance(f, DynamicsFactor)]
    linearized = []
    for i, (factor, ticks, linear) in enumerate(segment.linearized):
        residual = np.zeros_like(linear.residual)
        if i in touched:
            part = rows[touched.index(i)].by_size @ amount
            residual = -part * np.broadcast_to(factor.sigmas, part.shape)
        linearized.append((factor, ticks, type(linear)(residual, linear.by_state, linear.by_block)))
    return replaced(segment, x, linearized)


def replaced(segment, x, linearized):
    elimination = eliminate(accumulate(linearized, x, segment.calibration))
    fields = (segment.problem, segment.calibration, segment.signals, linearized, segment.stamps, elimination)
    return Segment(*fields)


@pytest.fixture(scope="module")
def long():
    return base("doggy", seconds=1.5)


def test_an_injected_effect_comes_out_with_its_size_and_sign(long):
    segment, x = long
    (hypothesis,) = hypotheses(segment.problem.robot, ["motor_viscous@joint2"])
    for amount in (2.0, -2.0):
        (score,) = ScoreTest([with_residual_of(segment, x, hypothesis, np.array([amount]))]).each([hypothesis])
        assert score.estimate[0] == pytest.approx(amount, rel=0.02)
        assert score.plausible[0] == (pytest.approx(score.score) if amount > 0 else 0.0)
        assert score.score > 0.0


def test_placebos_of_a_robot_with_a_rigid_joint_have_scores():
    segment, _ = base("joint 2 rigid", seconds=0.3)
    found = ScoreTest([segment]).placebo([_placebos(segment.signals)])
    assert np.all(np.isfinite(found)) and found.max() > 0.0
    assert found.min() == 0.0  # a rigid joint has no spring, so its load explains nothing


def test_look_alikes_correlate_and_others_do_not(long):
    """A lag and a delay agree to first order: the mean of a step's command moves by rate times time constant."""
    segment, _ = long
    chosen = hypotheses(segment.problem.robot, ["motor_lag@joint2", "command_delay@joint2", "gyro_scale@imu2"])
    joint = ScoreTest([segment]).together(chosen)
    assert joint.correlation(0, 1) > 0.95
    assert joint.correlation(0, 2) < 0.5


@pytest.mark.parametrize("order", (17.0, 30.0))
def test_the_order_of_an_injected_ripple_is_found(long, order):
    segment, x = long
    cogging = [t for t in hypotheses_of(segment.problem.robot, {"joint2": (order,)}) if t.label == "cogging@joint2"]
    rippled = with_residual_of(segment, x, cogging[0], np.array([0.4, 0.3]))
    found = scan_orders([rippled]).orders
    reach = np.ptp(x[:, segment.problem.robot.layout.motor_q[1]])
    assert min(abs(found["joint2"][i] - order) for i in range(len(found["joint2"]))) < np.pi / reach
