# SPDX-License-Identifier: BSD-3-Clause
"""Missing torque of one axis, made by hand: what is significant, what is large, and how large the noise is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.judging.torque_judge import TorqueJudge
from jointscope.graphs.judging.torque_noise import independent, yardstick_of
from jointscope.graphs.judging.torque_rows import TorqueRows

H, MEMORY, SIZE = 0.008, 0.05, 0.3


def coloured(rng, count):
    keep, z = np.exp(-H / MEMORY), [rng.normal() * SIZE]
    for kick in rng.normal(size=count - 1) * SIZE * np.sqrt(1.0 - keep**2):
        z.append(keep * z[-1] + kick)
    return np.array(z)


def axis(seed, extra, seconds=20.0):
    """An axis with dry and viscous friction in the base; `extra` is missing, a function of q and v [N]."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, H)
    v = 0.1 * np.sin(2.1 * t) + 0.08 * np.sin(5.3 * t + 1.0)
    q, a = np.cumsum(v) * H, np.gradient(v, H)
    drive = 90.0 * a + 20.0 * np.sign(v) + 200.0 * v
    moves = np.abs(v) > 1.5e-3
    rows = TorqueRows(
        joint="carriage",
        times=t[moves],
        missing=(coloured(rng, len(t)) + extra(q, v))[moves],
        base=np.column_stack([a, np.sign(v), v])[moves],
        drive=drive[moves],
        q=q[moves],
        v=v[moves],
        slowest=1.5e-3,
    )
    return TorqueJudge(Equations([rows]))


class Equations:
    """Stands in for the equations of a robot: a hypothesis brings its own column."""

    def __init__(self, rows):
        self.rows = rows
        count = rows[0].base.shape[1]
        self.expected, self.sigma = np.zeros(count), np.full(count, 100.0)

    def columns(self, hypothesis):
        return [np.column_stack([c(self.rows[0].q, self.rows[0].v) for c in hypothesis.columns])]


def hypothesis(*columns, sign=None, effect="torque_offset"):
    size = SimpleNamespace(name="torque", sign=sign, prior_sigma=100.0)
    here = SimpleNamespace(effect=SimpleNamespace(id=effect))
    return SimpleNamespace(columns=columns, sizes=(size,) * len(columns), here=here, shapes={})


def one(q, v):
    return np.ones_like(v)


def test_a_constant_force_is_let_in_with_its_size():
    found = axis(1, lambda q, v: 3.2 + 0.0 * v).judge([hypothesis(one)])
    assert found.refused == ""
    assert found.share > 0.9
    assert abs(found.sizes[0] - 3.2) < 3.0 * found.sigmas[0] < 0.4


@pytest.mark.parametrize("force", (3.2, 0.0))
def test_what_is_missing_is_told_in_newtons_although_a_base_parameter_is_told_by_its_prior_alone(force):
    judge = axis(1, lambda q, v: force + 0.0 * v)
    (rows,) = judge.rows
    # by the logarithm of k of 20 N tanh(k v), which is a sign long before the slowest of these rows
    sharp = 2e4
    base = np.column_stack([rows.base, 20.0 * sharp * rows.v / np.cosh(np.minimum(sharp * np.abs(rows.v), 300.0)) ** 2])
    judge = TorqueJudge(Equations([replace(rows, base=base)]))
    assert judge.missing[0] == pytest.approx(np.hypot(force, SIZE), rel=0.25)
    assert judge.missing[0] < 0.1 * judge.drive[0]


def test_what_is_there_but_small_is_said_and_not_let_in():
    faint = axis(2, lambda q, v: 0.07 + 0.0 * v, seconds=60.0).judge([hypothesis(one)])
    assert faint.net > 12.0
    assert faint.refused.startswith("there, but small")


@pytest.mark.parametrize(("force", "small"), [(0.25, True), (0.6, False)])
def test_what_takes_less_than_the_random_torque_beside_it_is_small(force, small):
    judge = axis(2, lambda q, v: force + 0.0 * v, seconds=60.0)
    drive = judge.drive[0]
    assert 0.003 * drive < 0.25 < SIZE < 0.01 * drive  # so that the random torque decides
    found = judge.judge([hypothesis(one)])
    assert found.net > 12.0 and found.share > 0.05 and found.small == small
    assert small or not found.refused


@pytest.mark.parametrize("seed", range(5))
def test_a_disturbance_with_a_memory_is_no_effect(seed):
    judge = axis(seed, lambda q, v: 0.0 * v)
    for column in (one, lambda q, v: v * np.abs(v), lambda q, v: np.sin(40.0 * q)):
        assert judge.judge([hypothesis(column)]).refused
    assert judge.unexplained < 0.1


def test_what_base_parameters_imitate_is_no_candidate():
    found = axis(3, one).judge([hypothesis(lambda q, v: -v)])
    assert "imitate" in found.refused
    assert found.score == 0.0


def test_a_group_loses_the_sizes_that_others_imitate_and_zeros():
    found = axis(3, lambda q, v: 3.2 + 0.0 * v).judge([hypothesis(lambda q, v: v, one, lambda q, v: 0.0 * v, one)])
    assert found.refused == ""
    assert found.dof == 1
    assert list(np.isfinite(found.sigmas)) == [False, True, False, False]
    np.testing.assert_array_equal(found.sizes[[0, 2, 3]], 0.0)
    assert abs(found.sizes[1] - 3.2) < 3.0 * found.sigmas[1]


def test_an_impossible_sign_is_no_candidate():
    assert axis(4, lambda q, v: -3.0 + 0.0 * v).judge([hypothesis(one, sign="+")]).refused


def test_nothing_is_larger_than_the_drive_that_overcomes_it():
    judge = axis(5, lambda q, v: 300.0 * np.sign(q))
    assert judge.judge([hypothesis(lambda q, v: np.sign(q))]).refused


@pytest.mark.parametrize("large", (0.0, 5.0))
def test_the_yardstick_does_not_swallow_a_smooth_law_that_is_missing(large):
    judge = axis(6, lambda q, v: large * np.sign(v) * np.exp(-((v / 0.02) ** 2)))
    assert 0.2 < judge.noise[0].size < 0.4
    assert 0.02 <= judge.noise[0].memory <= 0.1


def test_columns_that_others_imitate_and_zeros_are_left_out():
    rng = np.random.default_rng(7)
    X = rng.normal(size=(50, 2))
    assert independent(np.column_stack([X, X.sum(axis=1), np.zeros(50)])).shape == (50, 2)


def test_the_yardstick_is_likelier_than_its_neighbours_say():
    judge = axis(8, lambda q, v: 0.0 * v)
    again = yardstick_of(judge.rows[0], judge.blocks[0])
    assert again == judge.noise[0]
