# SPDX-License-Identifier: BSD-3-Clause
"""Whether a joint moves or stands, judged against the noise of its encoder and against the joints that move most.

A held joint has noise, creeps a little, and gives way a little when others are moved: it stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.screening import MOVED_ANGLE, MOVED_SIGMAS
from jointscope.tools.robot_guess.sensor_noise import guess_noise
from jointscope.tools.robot_guess.signals import Signal

Array = NDArray[np.float64]

GIVES_WAY = 0.02  # of the largest motion of a joint of its kind; who holds still within that is held
NEIGHBOURS = 5  # samples whose median is no glitch
STEPS = 3.0  # of a coarse encoder that noise and creep may make
MOST_FINITE = 0.5  # share of the samples that must be numbers


@dataclass(frozen=True)
class Stance:
    """How a joint behaves in a recording, in the unit of the bag.

    Attributes:
        mean: of its positions.
        span: from the lowest to the highest, without glitches.
        least: what noise and steps of the encoder make of it.
        moves: whether it moves; False where it stands.
    """

    mean: float
    span: float
    least: float
    moves: bool


def stances(signal: Signal, names: Sequence[str], slides: Sequence[bool]) -> Mapping[str, Stance]:
    """Which of some joints of a position signal move; those without samples are left out.

    Args:
        signal: positions.
        names: of the joints in its messages.
        slides: whether each of them is prismatic, so that its positions are lengths.
    """
    values = signal.columns(tuple(names))
    kept = [k for k in range(len(names)) if np.isfinite(values[:, k]).mean() > MOST_FINITE]
    mean = {k: float(np.nanmean(values[:, k])) for k in kept}
    span = {k: _span(values[:, k]) for k in kept}
    least = {k: _least(signal.times, values[:, k]) for k in kept}
    moved = [k for k in kept if span[k] > least[k]]
    largest = {slide: max((span[k] for k in moved if slides[k] == slide), default=0.0) for slide in (False, True)}
    return {
        names[k]: Stance(mean[k], span[k], least[k], k in moved and span[k] > GIVES_WAY * largest[slides[k]])
        for k in kept
    }


def _span(values: Array) -> float:
    good = values[np.isfinite(values)]
    if len(good) < NEIGHBOURS:
        return float(np.ptp(good)) if len(good) else 0.0
    around = np.lib.stride_tricks.sliding_window_view(good, NEIGHBOURS)
    return float(np.ptp(np.median(around, axis=1)))


def _least(times: Array, values: Array) -> float:
    good = np.isfinite(values)
    noise = guess_noise(times[good], values[good, None], "")
    levels = np.unique(values[good])
    # a counter at few levels shows its step only in their distance
    step = float(np.diff(levels).min()) if 1 < len(levels) <= 2 * STEPS else 0.0
    return max(MOVED_ANGLE, MOVED_SIGMAS * noise.sigma, STEPS * step)
