# SPDX-License-Identifier: BSD-3-Clause
"""Whether drive signal and sensors were stamped by one clock.

A delay of a fraction of a millisecond is friction that is not there, and no residual shows it;
`graphs/scoring/drive_timing.py` does.
"""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.scoring.regression.late_drives import LAG
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.half_a_sample import NEAR_STEP, how_to_hold, is_half_a_sample

FAR = 0.02  # share of a value by which a delay that is not in the model may change it
LONG = 0.5  # of a value, beyond which one linear step does not say where it ends


def same_time(result: CalibrationResult) -> tuple[str, str]:
    """A level of `judgement.LEVELS` and a sentence."""
    timing = result.timing
    if timing is None:
        return "info", "The model has times of its own, or this was not looked at."
    delay, sigma = abs(timing.delay), timing.sigma
    if not (names := timing.moved(result.found)):
        return "good", f"Give or take {significant(1e3 * max(delay, sigma), 2)} ms, which changes no value by much."
    if result.exchanged:
        return "info", "That cannot be judged as long as joints have each other's commands or positions."
    if result.asked.names and not result.asked.late:  # what is missing there looks late to one linear step
        return "info", "What the regression names explains what looks late; it can be judged once that is fixed."
    worst = max((p for p in result.parameters if p.name in names), key=lambda p: abs(timing.changes[p.name]) / p.sigma)
    other = worst.value + timing.changes[worst.name]
    lag = result.asked.lag
    if lag is not None and lag.clearly and lag.effect == LAG and not timing.joint:
        what = (
            f"By regression torques follow the drive signal through a low-pass of first order, with a time constant of "
            f"about {significant(1e3 * lag.size, 2)} ms ({significant(0.5 / np.pi / lag.size, 2)} Hz), and not after a "
            "delay"
        )
        cure = timing.cure(result.start, LAG)
    else:
        side = "after" if timing.delay > 0.0 and not timing.joint else "before"
        what = f"The {timing.what} {significant(1e3 * delay, 2)} ± {significant(1e3 * sigma, 1)} ms {side} its stamp"
        cure = timing.cure(result.start)
        if not timing.joint and is_half_a_sample(result, timing.delay, NEAR_STEP):
            cure = f"about half a sample, {how_to_hold(result)}, then calibrate; if it is not so, {cure}"
    return (
        "bad" if abs(timing.changes[worst.name]) > FAR * abs(worst.value) else "warn",
        f"{what}, with which {would_be(worst.name, worst.value, other, worst.unit)}: {cure}.",
    )


def would_be(name: str, value: float, other: float, unit: str) -> str:
    """A clause on a value and on what a step makes of it."""
    if abs(other - value) > LONG * abs(value):
        return f"{name} would change by more than half"
    return f"{name} would be about {significant(other)} instead of {significant(value)} {unit}"
