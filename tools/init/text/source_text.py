# SPDX-License-Identifier: BSD-3-Clause
"""Lines of a robot file that say where a signal is recorded and how noisy it is."""

from __future__ import annotations

from jointscope.robots.units import si_factor, si_unit
from jointscope.tools.init.streams.sensor_noise import NoiseGuess
from jointscope.tools.init.streams.signals import Signal
from jointscope.tools.init.text.robot_line import line, number

FINEST = 1e-8  # [SI unit] sigma below which the noise is that of rounding in the computer


def source_lines(signal: Signal, unit: str, indent: int = 4) -> list[str]:
    """Topic, type, field and unit."""
    space = " " * indent
    return [
        line(f"topic: {signal.topic}", _timing(signal), indent=indent),
        f"{space}type: {signal.msgtype}",
        f"{space}field: {signal.field}",
        f"{space}unit: {unit}",
    ]


def _timing(signal: Signal) -> str:
    seen = signal.timing
    text = f"{seen.rate:.4g} Hz, jitter {1e3 * seen.jitter:.2f} ms"
    text += f", {seen.gaps} gap{'s' * (seen.gaps != 1)} of up to {seen.longest_gap:.3g} s" if seen.gaps else ""
    return text if signal.stamped else f"{text}; no stamps, times are those of reception"


def sigma_line(noise: NoiseGuess, unit: str) -> str:
    """The line with a sensor's noise, which was found in a unit of the bag."""
    sigma = max(si_factor(unit) * noise.sigma, FINEST) if noise.sigma > 0 else 1e-4
    reason = noise.reason if noise.sigma > 0 else "nothing to see in the recording; see the data sheet"
    return line(f"sigma: {number(sigma)}", f"[{si_unit(unit)}] {reason}", False, 4)
