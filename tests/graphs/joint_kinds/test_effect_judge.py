# SPDX-License-Identifier: BSD-3-Clause
"""Effects that do nearly the same: which one is missing, and which one only takes its place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from jointscope.graphs.joint_kinds.effect_judge import EffectJudge
from jointscope.graphs.joint_kinds.linear_kinds import LinearKinds
from jointscope.robots.geometry.arm_effects import FREQUENCY, KINDS, ArmHypothesis

ROWS, FOLDS = 400, 4


@dataclass(frozen=True)
class Rows:
    """A kind whose rows are white."""

    r: np.ndarray
    J: np.ndarray
    kind: str = FREQUENCY
    folds: int = FOLDS
    counted: float = ROWS

    def equations(self, extra, out=None):
        kept = np.arange(ROWS) % FOLDS != (-1 if out is None else out)
        A = self._wide(extra)[kept]
        return A.T @ A, A.T @ self.r[kept]

    def left_out(self, extra, step, fold):
        return float(np.sum((self.r + self._wide(extra) @ step)[np.arange(ROWS) % FOLDS == fold] ** 2))

    def _wide(self, extra):
        return np.hstack([self.J, extra]) if extra.size else self.J


@pytest.fixture
def looked():
    """A motor that says too little torque, one that does nearly the same, and one of its own, all in the recordings."""
    rng = np.random.default_rng(2)
    kind = next(kind for kind in KINDS if kind.id == "torque_constant_error")
    one, other, third = rng.standard_normal((3, ROWS, 1)) / kind.size
    columns = (one, 0.7 * one + 0.7 * other, third)
    return [
        (ArmHypothesis(kind, f"joint{j}"), {FREQUENCY: column}, 1) for j, column in enumerate(columns, 1)
    ], kind.size


def judge_of(r):
    J = np.random.default_rng(3).standard_normal((ROWS, 2))
    return EffectJudge(LinearKinds([Rows(r, J)], np.eye(2), np.zeros(2)), 3)


def test_an_effect_that_takes_the_place_of_another_one_is_explained_by_it(looked):
    (first, second, _), size = looked
    noise = np.random.default_rng(4).standard_normal(ROWS)
    judge = judge_of(noise - (1.5 * first[1][FREQUENCY] * size)[:, 0])
    found = [judge.candidate(*each) for each in (first, second)]
    assert [c.verdict for c in found] == ["missing", "missing"]
    assert found[0].evidence > found[1].evidence
    assert judge.explains(first, second)


def test_an_effect_that_is_there_as_well_is_not_explained(looked):
    (first, _, third), size = looked
    noise = np.random.default_rng(4).standard_normal(ROWS)
    judge = judge_of(noise - (1.5 * (first[1][FREQUENCY] + third[1][FREQUENCY]) * size)[:, 0])
    assert not judge.explains(first, third) and not judge.explains(third, first)
    found = judge.candidate(*third)
    assert found.beside_the_best is found
    assert replace(found, explained_by="payload@robot").beside_the_best.verdict == "possible"
