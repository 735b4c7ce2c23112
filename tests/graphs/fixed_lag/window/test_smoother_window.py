# SPDX-License-Identifier: BSD-3-Clause
"""The window against dense least squares over all ticks that ever were: late rows, rows taken out, ticks gone."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.fixed_lag.window.smoother_window import Rows, SmootherWindow

D, STEP = 4, 0.01
SCALE = np.array([1e-4, 1e-2, 1.0, 1e-3])


class Dense:
    """Least squares over everything, solved anew each time."""

    def __init__(self):
        self.rows, self.count = {}, 0

    def solve(self):
        A = np.zeros((sum(len(r.b) for r in self.rows.values()), D * self.count))
        b, at = np.concatenate([r.b for r in self.rows.values()]), 0
        for rows in self.rows.values():
            for tick, part in zip(rows.ticks, rows.A, strict=True):
                A[at : at + len(rows.b), D * tick : D * tick + D] += part
            at += len(rows.b)
        # columns of one size: numbers as small as 1e-10 would fall below the cut of the pseudo-inverse
        scale = np.tile(SCALE, self.count)
        Q, R = np.linalg.qr(A * scale)
        inverse = np.linalg.inv(R)
        return scale * (inverse @ (Q.T @ b)), (inverse @ inverse.T) * scale[:, None] * scale


class Both:
    """The same rows in the window and in the dense problem."""

    def __init__(self, lag, seed=1):
        self.window, self.dense, self.rng = SmootherWindow(lag, SCALE), Dense(), np.random.default_rng(seed)
        self.slots, self.waiting = {}, []

    def add(self, rows):
        number = len(self.dense.rows)
        self.waiting.append((number, self.window.add_rows(rows)))
        self.dense.rows[number] = rows
        return number

    def commit(self):
        slots = self.window.commit()
        for number, place in self.waiting:
            self.slots[number] = slots[place]
        self.waiting = []

    def step(self, tick, F=None, sigma=0.1):
        """A tick, and a step to it from the one before."""
        self.window.add_tick(tick, tick * STEP)
        self.dense.count = tick + 1
        if tick == 0:
            return self.add(Rows((0,), (np.diag(1.0 / SCALE),), self.rng.normal(size=D)))
        F = np.eye(D) + 0.1 * SCALE[:, None] * self.rng.normal(size=(D, D)) / SCALE if F is None else F
        T = np.diag(1.0 / (sigma * SCALE))
        return self.add(Rows((tick - 1, tick), (-T @ F, T), self.rng.normal(size=D)))

    def measure(self, *ticks):
        """Two rows on some ticks."""
        A = tuple(self.rng.normal(size=(2, D)) / SCALE for _ in ticks)
        return self.add(Rows(ticks, A, self.rng.normal(size=2)))

    def compare(self, ticks):
        mean, P = self.dense.solve()
        for tick in ticks:
            own = slice(D * tick, D * tick + D)
            np.testing.assert_allclose(self.window.deviation(tick) / SCALE, mean[own] / SCALE, atol=2e-4)
            scaled = (self.window.covariance(tick) - P[own, own]) / SCALE[:, None] / SCALE
            np.testing.assert_allclose(scaled, 0.0, atol=1e-7)


@pytest.mark.parametrize("together", [1, 5])
def test_a_chain_is_solved_like_one_big_problem_while_old_ticks_leave(together):
    both = Both(10.5 * STEP)
    for tick in range(31):
        both.step(tick)
        both.measure(tick)
        if tick and tick % 3 == 0:
            both.measure(tick - 1, tick)
        if tick % together == 0:
            both.commit()
    both.commit()
    assert not both.window.holds(19)
    both.compare(range(20, 31))


def test_rows_that_come_late_change_all_ticks_in_the_window():
    both = Both(10.5 * STEP, seed=2)
    for tick in range(20):
        both.step(tick)
        both.measure(tick)
        both.commit()
        if tick > 8 and tick % 4 == 0:
            before = both.window.deviation(tick)
            both.measure(tick - 5)
            both.measure(tick - 8, tick - 7)
            both.commit()
            assert np.abs((both.window.deviation(tick) - before) / SCALE).max() > 1e-6
    both.compare(range(10, 20))


def test_steps_can_be_replaced_after_the_fact():
    both, steps = Both(10.5 * STEP, seed=3), {}
    for tick in range(20):
        steps[tick] = both.step(tick)
        both.measure(tick)
        both.commit()
        if tick > 8 and tick % 5 == 0:
            for old in range(tick - 4, tick - 1):
                both.window.remove(both.slots[steps[old]])
                rows = both.dense.rows[steps[old]]
                both.dense.rows[steps[old]] = Rows((), (), np.zeros(0))
                looser = Rows(rows.ticks, tuple(0.3 * A for A in rows.A), 0.3 * rows.b + both.rng.normal(size=D))
                steps[old] = both.add(looser)
            both.commit()
    both.compare(range(10, 20))


@pytest.mark.parametrize("lag", [0.2 * STEP, 2.5 * STEP])
def test_a_lag_shorter_than_what_is_committed_together_works(lag):
    both = Both(lag, seed=4)
    for tick in range(16):
        both.step(tick)
        both.measure(tick)
        if tick % 5 == 0:
            both.commit()
    both.compare([15])


def test_nothing_to_commit_is_nothing():
    both = Both(0.1)
    both.step(0)
    both.commit()
    assert list(both.window.commit()) == []
