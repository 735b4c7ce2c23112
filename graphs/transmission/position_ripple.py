# SPDX-License-Identifier: BSD-3-Clause
"""Orders (periods per turn of a joint) at which the difference of its encoders repeats with the position.

Teeth of a gear and disks of encoders leave a ripple whose order nobody knows beforehand. The periodogram of what a
model leaves, over the position instead of time, has a peak there. Only a search, on the seconds that are fitted: those
between decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.candidates import Candidate
from jointscope.graphs.transmission.equation import Equation
from jointscope.graphs.transmission.regression import Choose, parts

Array = NDArray[np.float64]

EFFECT = "encoder_eccentricity"
FEWEST_PERIODS = 3.0  # over the range of positions; slower changes are no ripple
LARGEST_ORDER = 1000.0
LARGEST_PHASE = 1.5  # [rad] from one sample to the next in ordinary motion; beyond, the samples are too sparse
POINTS = 8.0  # of the periodogram per independent order


def ripple_name(joint: str, part: str) -> str:
    """Full name of a parameter of a joint's ripple: cos, sin or order."""
    return f"{joint}.{EFFECT}.{part}"


def with_order(equations: Sequence[Equation], candidate: Candidate) -> list[Equation]:
    """The equations with a ripple at its order; as they are for any other effect."""
    if candidate.effect != EFFECT:
        return list(equations)
    gear = f"{candidate.owner}.gear"
    return [_at_order(e, candidate.owner, candidate.order) if e.name == gear else e for e in equations]


def strongest_order(
    equations: Sequence[Equation], names: Sequence[str], sizes: Array, joint: str, choose: Choose
) -> float | None:
    """Where the periodogram of a joint's gear equation is largest; None where no order can be seen.

    Args:
        equations: of all recordings.
        names: columns of the model.
        sizes: of these columns, fitted to the same samples.
        joint: whose ripple.
        choose: samples to look at.
    """
    own = [e for e in equations if e.name == f"{joint}.gear" and e.position is not None]
    if not own:
        return None
    left = np.concatenate([piece.error - piece.columns @ sizes for piece in parts(own, names, choose)])
    q = np.concatenate([e.position[choose(e)] for e in own if e.position is not None])
    span, step = float(np.ptp(q)), max(_usual_step(e.position) for e in own if e.position is not None)
    lowest = FEWEST_PERIODS * 2.0 * np.pi / max(span, 1e-9)
    highest = min(LARGEST_ORDER, LARGEST_PHASE / max(step, 1e-9))
    if lowest >= highest:
        return None
    orders = np.arange(lowest, highest, 2.0 * np.pi / span / POINTS)
    power = np.array([abs(np.dot(left, np.exp(1j * order * q))) for order in orders])
    return float(orders[int(np.argmax(power))])


def _at_order(equation: Equation, joint: str, order: float) -> Equation:
    q = equation.position
    assert q is not None
    waves = {"cos": np.cos(order * q)[:, None], "sin": np.sin(order * q)[:, None]}
    columns = {**equation.columns, **{ripple_name(joint, part): wave for part, wave in waves.items()}}
    return replace(equation, columns=columns)


def _usual_step(q: Array) -> float:
    """Change of the position from one sample to the next while the joint moves."""
    steps = np.abs(np.diff(q))
    moving = steps[steps > 0.1 * float(np.max(steps, initial=0.0))]
    return float(np.median(moving)) if len(moving) else 0.0
