# SPDX-License-Identifier: BSD-3-Clause
r"""Regression of all joints together on columns that they share: one body, one zero, one direction of gravity.

    k u = M a + c + g + (columns x sizes: the same sizes at all joints) + b a + d v + mu sign(v)

Each joint keeps its own constant, rotor and friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.regression.evidence import evidence
from jointscope.graphs.scoring.regression.joint_regression import JointRows, design_of, fit

Array = NDArray[np.float64]

ROUNDS = 3  # in which constants of drives are found with the sizes


class SharedRows(NamedTuple):
    """One joint's regression beside the columns of a link.

    Attributes:
        joint: index.
        rows: of the joint alone, of the effects that the robot has, and of the link, shape (w, 5 + e + k).
        blocks: of each window, shape (w,).
        width: how many columns the link has, k.
        plain: mean square that is left without the link.
        seconds: of motion that the windows tell of.
    """

    joint: int
    rows: Array
    blocks: NDArray[np.intp]
    width: int
    plain: float
    seconds: float

    def without(self, block: int) -> SharedRows:
        """The same where a block of time is left out."""
        kept = self.blocks != block
        return self._replace(rows=self.rows[kept], blocks=self.blocks[kept])


class Told(NamedTuple):
    """What windows of one width say of one link, or of several together.

    Attributes:
        here: the first of them, with the sizes of all.
        sizes: how many are found, one for the mass alone.
        some, found, left, evidence: rows of each joint, sizes, mean squares that are left, and the evidence.
        together: all of them.
    """

    here: EffectHypothesis
    sizes: int
    some: list[SharedRows]
    found: Array
    left: list[float]
    evidence: float
    together: tuple[EffectHypothesis, ...]


def told_of(
    rows: JointRows,
    link: EffectHypothesis,
    width: float,
    counts: tuple[int, ...],
    beside: tuple[EffectHypothesis, ...] = (),
) -> list[Told]:
    """What windows of one width [s] say of a link, by so many of its sizes: of its mass, and of its first moments.

    Args:
        rows: of the regression.
        link: what the joints share.
        width: of windows [s].
        counts: of sizes, those of all together.
        beside: what else they share.
    """
    together = (link, *beside)
    link = replace(link, sizes=tuple(size for one in together for size in one.sizes))
    all_columns = {joint: _columns(rows, joint, together) for joint in range(rows.robot.n)}
    some = []
    for joint, columns in all_columns.items():
        if columns is not None:
            windows = rows.beside(joint, width, rows.with_own(joint, columns))
            if windows is not None:
                count = len(columns[0])
                plain = fit(rows.robot, joint, windows[0][:, :-count]).left
                some.append(
                    SharedRows(joint, *windows, count, max(plain, 1e-300), rows.seconds(width, len(windows[0])))
                )
    if not some:
        return []
    told = []
    for sizes in counts:
        kept = [one._replace(rows=one.rows[:, : one.rows.shape[1] - one.width + sizes], width=sizes) for one in some]
        found, left = solved(rows, link, kept)
        worth = [evidence(one.plain, share, one.seconds, 0) for one, share in zip(kept, left, strict=True)]
        cost = evidence(1.0, 1.0, max(one.seconds for one in kept), sizes)
        told.append(Told(link, sizes, kept, found, left, sum(worth) + cost, together))
    return told


def _columns(rows: JointRows, joint: int, together: Sequence[EffectHypothesis]) -> list[list[Array]] | None:
    """Columns of all in each recording, zero where one does not act on a joint; None where none does."""
    found = [rows.columns(joint, one) for one in together]
    if all(some is None for some in found):
        return None
    nothing = [[np.zeros_like(one) for one in some] for some in rows.constant()]
    silent = [[some * len(link.sizes) for some in nothing] for link in together]
    every = [none if some is None else some for some, none in zip(found, silent, strict=True)]
    return [[column for some in parts for column in some] for parts in zip(*every, strict=True)]


def solved(rows: JointRows, link: EffectHypothesis, some: Sequence[SharedRows]) -> tuple[Array, list[float]]:
    """Sizes that all joints agree on, shape (k,), and the mean square that each joint leaves with them."""
    robot, count = rows.robot, some[0].width
    gains = [fit(robot, one.joint, one.rows[:, :-count]).gain for one in some]
    free = [fit(robot, one.joint, one.rows).left for one in some]
    prior = np.array([size.prior_sigma for size in link.sizes[:count]])
    sizes: Array = np.zeros(count)
    left = list[float]()
    for _ in range(ROUNDS):
        H, h = np.diag(1.0 / prior**2), np.zeros(count)
        for one, gain, square in zip(some, gains, free, strict=True):
            _, X, target = design_of(robot, one.joint, one.rows)
            own, columns = _unit(X[:, :-count]), X[:, -count:] / gain
            columns, target = columns - own @ (own.T @ columns), target - own @ (own.T @ target)
            H += columns.T @ columns / max(square, 1e-300)
            h += columns.T @ target / max(square, 1e-300)
        sizes, left, gains = np.asarray(np.linalg.solve(H, h)), [], list(gains)
        for i, one in enumerate(some):
            with_it = fit(robot, one.joint, with_sizes(one, sizes))
            left.append(with_it.left)
            gains[i] = with_it.gain
    return sizes, left


def _unit(columns: Array) -> Array:
    """An orthonormal basis of some columns."""
    size = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
    basis, values, _ = np.linalg.svd(columns / size, full_matrices=False)
    return np.asarray(basis[:, values > 1e-10 * values[0]]) if values.size else columns


def with_sizes(one: SharedRows, sizes: Array) -> Array:
    """Rows of a joint whose link weighs what is found: its torque is a part of the load."""
    rows = one.rows[:, : -one.width].copy()
    rows[:, 1] += one.rows[:, -one.width :] @ sizes
    return rows
