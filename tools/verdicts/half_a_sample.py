# SPDX-License-Identifier: BSD-3-Clause
"""Delays of half a sample: what a drive signal shows that is held and was taken for a measured one, or the other way.

chords between samples of steps   act half a sample too early: delay = +T/2
steps at samples of chords        act half a sample too late:  delay = -T/2
"""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.scoring.drive_timing import EFFECT
from jointscope.graphs.screening.mistaken_hold import ACTS, held_otherwise
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.tools.presentation.numbers import significant

NEAR_FITTED, NEAR_STEP = 0.05, 0.25  # shares of half a sample by which a fitted delay, and one linear step, may be off


def is_half_a_sample(result: CalibrationResult, delay: float, near: float) -> bool:
    """Whether a delay is that of a drive signal which is held otherwise than the robot file says.

    Args:
        result: a calibration.
        delay: of the drive signal after its stamps [s].
        near: share by which it may be off.
    """
    periods = [float(np.median(np.diff(bag.recording.command.times))) for bag in result.bags if bag.recording.streams]
    if not periods:
        return False
    half = 0.5 * max(periods) * (-1.0 if result.start.command_held else 1.0)
    return bool(abs(delay - half) < near * abs(half))


def how_to_hold(result: CalibrationResult) -> str:
    """What such a delay says, and what to write."""
    held = result.start.command_held
    return (
        f"as where the drive signal {ACTS[not held]} and the robot file says that it {ACTS[held]}: if that is so, "
        f"write {held_otherwise(result.start)}"
    )


def fitted_half_sample(result: CalibrationResult) -> str:
    """A sentence on a delay of half a sample that was calibrated; empty where there is none."""
    for p in result.parameters:
        if p.name.endswith(f".{EFFECT}.delay") and is_half_a_sample(result, p.value, NEAR_FITTED):
            time = significant(1e3 * abs(p.value), 3)
            effect = p.name.removesuffix(".delay").split(".")
            taken_out = f"`jointscope remove {robot_argument(result.start)} {effect[1]}@{effect[0]}"
            return (
                f"The fitted {p.name} is half a sample ({time} ms), {how_to_hold(result)}, then {taken_out} -o "
                f"{edited_argument(result.start, 'without')}` and calibrate that."
            )
    return ""
