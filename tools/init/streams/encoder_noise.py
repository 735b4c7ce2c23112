# SPDX-License-Identifier: BSD-3-Clause
"""Noise of each joint's encoder: its own, that of its like, or that of joints that stand where a motion hides it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.streams.sensor_noise import FEWEST_LEVELS, NoiseGuess, guess_each, noise_in_motion
from jointscope.tools.init.streams.standing import ROUGHER, Stance

MUCH = 1.5  # ratio from which two encoders do not measure alike


def encoder_noise(
    encoder: Stream, units: Sequence[str], slides: Sequence[str], stances: Mapping[str, Stance]
) -> tuple[NoiseGuess, ...]:
    """Noise by joint; those that measure alike have the same.

    Args:
        encoder: positions as they stand in the bag; its channels are in the order of `units`.
        units: of the joints.
        slides: names of the prismatic joints.
        stances: all joints that the bag has, by name, among them those that stand.
    """
    values = encoder.values
    measured = np.isfinite(encoder.measured).T
    each = [
        guess_each(encoder.times[seen], values[seen, j : j + 1], [unit])[0]
        for j, (unit, seen) in enumerate(zip(units, measured, strict=True))
    ]
    moving = [noise_in_motion(encoder.times[seen], values[seen, j]) for j, seen in enumerate(measured)]
    each = [_with_motion(guess, sigma) for guess, sigma in zip(each, moving, strict=True)]
    of_unit = {unit: _middle([guess for guess, u in zip(each, units, strict=True) if u == unit]) for unit in units}
    at_rest = {
        slide: [s.noise for joint, s in stances.items() if not s.moves and s.noise > 0 and (joint in slides) == slide]
        for slide in (False, True)
    }
    found = []
    for j, unit in enumerate(units):
        own = each[j]
        resting = at_rest[unit in ("m", "mm")]
        if resting and not moving[j] and own.sigma > ROUGHER * float(np.median(resting)):
            text = "that of joints that stand still; the motion is too fast for the rate to show it"
            found.append(NoiseGuess(float(np.median(resting)), text))
            continue
        few = len(np.unique(values[:, j])) < FEWEST_LEVELS
        alike = own.sigma / MUCH < of_unit[unit].sigma < own.sigma * MUCH
        found.append(of_unit[unit] if few or alike else own)
    return tuple(found)


def _with_motion(guess: NoiseGuess, moving: float) -> NoiseGuess:
    """The noise while a joint moves, where it is clearly larger than in quiet stretches: only motion weighs there."""
    if moving <= MUCH * guess.sigma:
        return guess
    return NoiseGuess(moving, "what no smooth motion explains while the joint moves; stamps that jitter add to it")


def _middle(guesses: Sequence[NoiseGuess]) -> NoiseGuess:
    return sorted(guesses, key=lambda guess: guess.sigma)[len(guesses) // 2]
