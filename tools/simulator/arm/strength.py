# SPDX-License-Identifier: BSD-3-Clause
"""How hard motors are shaken: as hard as their drives can, but so that they stay near their pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.tools.simulator.arm.multisine import Multisine
from jointscope.tools.simulator.loop.shaker import SERVO

Array = NDArray[np.float64]
OVER_FRICTION = 2.0  # rms of the excitation over dry friction, at least
DISPLACEMENT = 0.02  # [rad or m] rms of a motor, at most: the response is that of the pose


def largest_amplitude(unit: Multisine, share: float, left: Array, inertia: Array, dry: Array) -> Array:
    """Amplitude of each line of each input, shape (n,) [N m or N].

    Args:
        unit: the multisine with an amplitude of its own.
        share: of what is left to a drive that the largest of its multisine takes.
        left: torque of each drive beside the weight, shape (n,); infinite where it is not known.
        inertia: that each motor moves, shape (n,).
        dry: friction of each motor, shape (n,) [N m or N], which its excitation exceeds even if it moves farther then.

    Raises:
        SimulationError: a share that is none.
    """
    if not 0.0 < share < 1.0:
        raise SimulationError(f"share {share:g} of the drives: expected more than 0 and less than 1")
    count, n, _ = unit.phases.shape
    step = 0.1 / (unit.f0 * float(unit.lines.max()))
    step = 1.0 / (unit.f0 * np.ceil(1.0 / (unit.f0 * step)))  # a whole number in a period
    waves = [unit.torque(r, e, 1, step) for r in range(count) for e in range(n)]
    peaks = np.max(np.abs(waves), axis=(0, 1)) / unit.amplitude
    w = 2.0 * np.pi * unit.f0 * unit.lines
    moves = np.sqrt(0.5 * np.sum((SERVO**2 + w**2) ** -2.0)) / inertia  # rms under the controller, of amplitude one
    over_friction = OVER_FRICTION * dry * np.sqrt(2.0 / len(unit.lines))
    return np.asarray(np.minimum(share * left / peaks, np.maximum(DISPLACEMENT / moves, over_friction)))
