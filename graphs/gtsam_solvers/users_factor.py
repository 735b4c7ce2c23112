# SPDX-License-Identifier: BSD-3-Clause
"""A factor of the user's own, looked at before GTSAM linearises it.

GTSAM says nothing that one could read of a Jacobian with another shape.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import gtsam
import numpy as np


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
    return ""
