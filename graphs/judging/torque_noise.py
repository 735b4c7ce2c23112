# SPDX-License-Identifier: BSD-3-Clause
"""The yardstick: a torque with a memory beside white noise, estimated once, with every smooth law released.

    cov(t, t') = s^2 (exp(-|t - t'| / T) + r^2 [t = t'])

T and r have the largest restricted likelihood on a grid, s follows in closed form. Rows are whitened block by block, so
that blocks can be left out; a gap within a block is no more than a longer distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.judging.torque_rows import TorqueRows

Array = NDArray[np.float64]

MEMORIES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # [s]
WHITE = (0.03, 0.1, 0.3, 1.0, 3.0)  # r
WIDTHS = 5  # speeds over which dry friction may fall
LOST = 1e-9  # relative size of what is left of a column that others imitate


@dataclass(frozen=True)
class Yardstick:
    """Noise of one equation.

    Attributes:
        size: s [N m].
        memory: T [s].
        white: r.
    """

    size: float
    memory: float
    white: float

    def whitened(self, times: Array, values: Array, blocks: NDArray[np.intp]) -> Array:
        """Values, shape (m, k), with independent errors of variance one; nothing is remembered between blocks."""
        from jointscope.graphs.kernels.innovations import innovations

        return np.asarray(innovations(times, values, blocks, self.memory, self.white)[0] / self.size)


def yardstick_of(rows: TorqueRows, blocks: NDArray[np.intp]) -> Yardstick:
    """The likeliest noise beside base parameters and smooth laws; blocks by row, shape (m,)."""
    from jointscope.graphs.kernels.innovations import innovations

    X = independent(np.hstack([rows.base, saturated(rows)]))
    values = np.column_stack([X, rows.missing])
    best: tuple[float, Yardstick] | None = None
    for memory in MEMORIES:
        for white in WHITE:
            Y, log_determinant = innovations(rows.times, values, blocks, memory, white)
            R: Array = np.linalg.qr(Y)[1]
            freedom = len(Y) - X.shape[1]
            s2 = max(float(R[-1, -1] ** 2) / freedom, 1e-300)
            log_border = 2.0 * float(np.sum(np.log(np.abs(np.diag(R)[:-1]) + 1e-300)))
            evidence = -0.5 * (freedom * np.log(s2) + 2.0 * log_determinant + log_border)
            if best is None or evidence > best[0]:
                best = evidence, Yardstick(float(np.sqrt(s2)), memory, white)
    assert best is not None
    return best[1]


def saturated(rows: TorqueRows) -> Array:
    """Every smooth law of a joint as a column, shape (m, k): no ripple, nothing built from the command."""
    q, v = rows.q - np.mean(rows.q), rows.v
    q, fast = q / max(float(np.max(np.abs(q))), 1e-12), float(np.quantile(np.abs(v), 0.95))
    sign, speed = np.sign(v), v / max(fast, 1e-12)
    falling = [sign * np.exp(-((v / w) ** 2)) for w in speeds(rows)[:: max(len(speeds(rows)) // WIDTHS, 1)]]
    smooth = [np.ones_like(v), sign, speed, speed * np.abs(speed), np.abs(speed), sign * q, q, q**2, q**3]
    return np.column_stack([*smooth, *falling])


def speeds(rows: TorqueRows) -> Array:
    """Nine speeds over which a law of a joint may change, from three times the slowest that is told [rad/s]."""
    fast = float(np.quantile(np.abs(rows.v), 0.95))
    low = max(3.0 * rows.slowest, fast / 300.0)
    return np.geomspace(low, max(0.5 * fast, 1.5 * low), 9)


def independent(X: Array) -> Array:
    """The columns that those before them do not imitate, scaled to one."""
    kept: list[Array] = []
    basis = np.zeros((len(X), 0))
    for column in X.T:
        norm = float(np.linalg.norm(column))
        if norm == 0.0:
            continue
        rest = column / norm
        rest = rest - basis @ (basis.T @ rest)
        if float(rest @ rest) < LOST:
            continue
        kept.append(column / norm)
        basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
    return np.column_stack(kept) if kept else np.zeros((len(X), 0))
