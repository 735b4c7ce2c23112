# SPDX-License-Identifier: BSD-3-Clause
"""The units a bag may use, and how they become SI units."""

from __future__ import annotations

import math

UNITS: dict[str, tuple[str, float]] = {
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180.0),
    "turn": ("rad", 2.0 * math.pi),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180.0),
    "rpm": ("rad/s", 2.0 * math.pi / 60.0),
    "duty": ("1", 1.0),
    "V": ("V", 1.0),
    "A": ("A", 1.0),
    "N m": ("N m", 1.0),
}
"""Unit in a bag: its SI unit and the factor that turns a value into it."""


def si_unit(unit: str) -> str:
    """The SI unit of a bag's unit."""
    return UNITS[unit][0]


def si_factor(unit: str) -> float:
    """The factor from a bag's unit to the SI unit."""
    return UNITS[unit][1]
