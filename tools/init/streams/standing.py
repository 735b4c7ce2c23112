# SPDX-License-Identifier: BSD-3-Clause
"""Whether a joint moves or stands, judged against the noise of its encoder and against the joints that move most.

A held joint has noise, creeps a little, and gives way a little when others are moved: it stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.recordings.resting_joints import MOVED_ANGLE, MOVED_SIGMAS
from jointscope.tools.init.streams.sensor_noise import column_noise
from jointscope.tools.init.streams.signals import Signal

Array = NDArray[np.float64]

GIVES_WAY = 0.02  # of the largest motion of a joint of its kind; who holds still within that is held
NEIGHBOURS = 5  # samples whose median is no glitch
STEPS = 3.0  # of a coarse encoder that noise and creep may make
ROUGHER = 10.0  # times the noise of the best encoder that another one may have
MOST_FINITE = 0.5  # share of the samples that must be numbers


@dataclass(frozen=True)
class Stance:
    """How a joint behaves in a recording, in the unit of the bag.

    Attributes:
        mean: of its positions.
        span: from the lowest to the highest, without glitches.
        least: what noise and steps of the encoder make of it.
        moves: whether it moves; False where it stands.
        noise: standard deviation of its encoder.
    """

    mean: float
    span: float
    least: float
    moves: bool
    noise: float = 0.0


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
    noise = _noises(signal.times, values, kept)
    found: dict[str, Stance] = {}
    for slide in (False, True):
        alike = [k for k in kept if slides[k] == slide]
        # encoders of a kind are alike; what is rougher by far is a motion too fast for the rate
        usual = ROUGHER * min((noise[k] for k in alike if noise[k] > 0.0), default=0.0)
        least = {k: max(MOVED_ANGLE, MOVED_SIGMAS * min(noise[k], usual), _steps(values[:, k])) for k in alike}
        largest = max((span[k] for k in alike if span[k] > least[k]), default=0.0)
        found |= {
            names[k]: Stance(mean[k], span[k], least[k], span[k] > max(least[k], GIVES_WAY * largest), noise[k])
            for k in alike
        }
    return found


def _noises(times: Array, values: Array, kept: Sequence[int]) -> dict[int, float]:
    """Noise of some columns; where all their samples are numbers, in one go."""
    good = np.isfinite(values[:, list(kept)])
    if good.all():
        return dict(zip(kept, column_noise(times, values[:, list(kept)]), strict=True))
    return {k: column_noise(times[rows], values[rows][:, [k]])[0] for k, rows in zip(kept, good.T, strict=True)}


def _span(values: Array) -> float:
    good = values[np.isfinite(values)]
    if len(good) < NEIGHBOURS:
        return float(np.ptp(good)) if len(good) else 0.0
    around = np.lib.stride_tricks.sliding_window_view(good, NEIGHBOURS)
    return float(np.ptp(np.median(around, axis=1)))


def _steps(values: Array) -> float:
    """Some steps of a counter that is at few levels only; 0 for others."""
    levels = np.unique(values[np.isfinite(values)])
    return STEPS * float(np.diff(levels).min()) if 1 < len(levels) <= 2 * STEPS else 0.0
