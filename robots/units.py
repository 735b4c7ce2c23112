# SPDX-License-Identifier: BSD-3-Clause
"""The units a bag may use, and how they become SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence

UNITS: dict[str, tuple[str, float]] = {
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180.0),
    "turn": ("rad", 2.0 * math.pi),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", math.pi / 180.0),
    "rpm": ("rad/s", 2.0 * math.pi / 60.0),
    "duty": ("1", 1.0),
    "V": ("V", 1.0),
    "A": ("A", 1.0),
    "mA": ("A", 1e-3),
    "N m": ("N m", 1.0),
    "m/s^2": ("m/s^2", 1.0),
    "g": ("m/s^2", 9.80665),
}
"""Unit in a bag: its SI unit and the factor that turns a value into it."""


OF_SLIDES: dict[str, str] = {
    "rad": "m",
    "rad/s": "m/s",
    "rad/s^2": "m/s^2",
    "rad/rad": "1",
    "rad/(N m)": "m/N",
    "N m": "N",
    "N m/V": "N/V",
    "N m/A": "N/A",
    "N m/rad": "N/m",
    "N m/rad^3": "N/m^3",
    "N m s/rad": "N s/m",
    "N m s^2/rad^2": "N s^2/m^2",
    "A s/rad": "A s/m",
    "kg m2": "kg",
    "s/rad": "s/m",
}
"""Units of a turning joint's quantities and what they are for a sliding one; all others are the same."""


def joined(units: Sequence[str]) -> str:
    """Different units once each, as one text: "rad, m"."""
    return ", ".join(dict.fromkeys(units))


def of_slide(unit: str) -> str:
    """The unit of the same quantity at a prismatic joint."""
    return OF_SLIDES.get(unit, unit)


def si_unit(unit: str) -> str:
    """The SI unit of a bag's unit."""
    return UNITS[unit][0]


def si_factor(unit: str) -> float:
    """The factor from a bag's unit to the SI unit."""
    return UNITS[unit][1]
