# SPDX-License-Identifier: BSD-3-Clause
"""A factor of the user's own, looked at before GTSAM linearises it.

GTSAM says nothing that one could read of a Jacobian with another shape, and its optimizer returns the start where one
has the wrong sign or column, as if that were the minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import gtsam
import numpy as np
from numpy.typing import NDArray

STEPS = (1e-4, 1e-6)  # of differences; at a kink one of them may be wrong
UNLIKE = 0.1  # share of a Jacobian by which differences may be others: some leave out what is small


def what_is_wrong(
    factor: gtsam.NonlinearFactor, values: gtsam.Values, sizes: Mapping[int, int], named: Callable[[int], str]
) -> str:
    """What keeps a factor from being used at some values, to stand behind its name; empty where nothing does.

    Args:
        factor: of the user; all its keys are in `values`.
        values: where it is evaluated.
        sizes: dimension of each of its variables, by key.
        named: name of a variable, by key.
    """
    try:
        error = factor.error(values)
        if not np.isfinite(error):
            start = "correct the factor, or start from other values"
            return f"has the error {error:g} at these values; expected a finite one: {start}"
        if not isinstance(factor, gtsam.NoiseModelFactor):
            return ""
        H = gtsam.JacobianVector([np.zeros((1, 1), order="F") for _ in factor.keys()])
        rows = len(factor.unwhitenedError(values, H))
    except Exception as err:  # whatever the user's own function raises
        reason = " ".join(str(err).split())[:160]
        return f"cannot be evaluated ({type(err).__name__}: {reason}); correct its function, its noise model or its key"
    for i, (key, J) in enumerate(zip(factor.keys(), H, strict=True)):
        if np.shape(J) != (rows, sizes[key]):
            return (
                f"has a Jacobian H[{i}] of shape {np.shape(J)} by {named(key)}; expected ({rows}, {sizes[key]}): a row "
                "for each error, a column for each number of the variable"
            )
        if not np.all(np.isfinite(J)):
            return f"has a Jacobian H[{i}] by {named(key)} that is not finite; correct its derivatives"
    for i, (key, J) in enumerate(zip(factor.keys(), H, strict=True)):
        unlike = [_unlike(J, _differences(factor, values, key, sizes[key], step)) for step in STEPS]
        if np.all(np.array(unlike) > UNLIKE):
            return (
                f"has a Jacobian H[{i}] by {named(key)} that is not the derivative of its error: differences are "
                f"{100 * min(unlike):.0f} % off; correct its sign, its columns or its scale"
            )
    return ""


def _differences(
    factor: gtsam.NoiseModelFactor, values: gtsam.Values, key: int, size: int, step: float
) -> NDArray[np.float64]:
    """Derivative of the error by a variable, by central differences, shape (rows, size)."""
    columns = []
    for direction in step * np.eye(size):
        ends = []
        for change in (direction, -direction):
            moved = gtsam.VectorValues()
            moved.insert(key, change)
            ends.append(np.asarray(factor.unwhitenedError(values.retract(moved))))
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    return np.stack(columns, axis=1)


def _unlike(J: NDArray[np.float64], differences: NDArray[np.float64]) -> float:
    """How far two Jacobians are apart, as a share of the larger one; nothing where differences are not finite."""
    size = max(float(np.linalg.norm(J)), float(np.linalg.norm(differences)))
    apart = float(np.linalg.norm(J - differences))
    return apart / size if size > 0.0 and np.isfinite(apart) else 0.0
