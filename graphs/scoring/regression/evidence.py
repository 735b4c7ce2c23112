# SPDX-License-Identifier: BSD-3-Clause
"""How much more plausible one reason is than another: what it leaves open, at which noise, and what its sizes cost."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.scoring.hypothesis_score import INDEPENDENT
from jointscope.graphs.starts.drive_regression import MOST_NOISE

AS_GOOD = 1.2  # times the mean square that the best cause leaves, up to which another one is as good


def evidence(plain: float, left: float, seconds: float, sizes: int) -> float:
    """By how much a cause is more plausible than none, as a logarithm: what it explains less what its sizes cost.

    The Bayesian information criterion with a noise that is not known. Of causes that are asked of the same joints, the
    most plausible one has the most of it; that counts all joints, and a joint that has little to tell counts little.

    Args:
        plain: mean square that the plain regression leaves.
        left: mean square that is left with it.
        seconds: of motion that are told of.
        sizes: that it has.

    Reference:
        Schwarz (1978), Estimating the dimension of a model, Annals of Statistics 6(2).
    """
    count = max(seconds / INDEPENDENT, 1.0)
    return float(0.5 * count * np.log(max(plain, 1e-300) / max(left, 1e-300)) - 0.5 * sizes * np.log(count))


def nearly(seconds: float) -> float:
    """How much less evidence another cause may have that leaves AS_GOOD times as much, and so is as good."""
    return evidence(AS_GOOD, 1.0, seconds, 0)


def beyond(left: float, plain: float, noise: float) -> tuple[float, float]:
    """What is left with a cause and without it beyond the noise of the encoders, as far as that can be believed."""
    taken_off = min(noise, MOST_NOISE * left)
    return left - taken_off, plain - taken_off
