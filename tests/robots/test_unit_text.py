# SPDX-License-Identifier: BSD-3-Clause
"""Units as people write them, and all units that robots and effects have."""

import math

import pytest

from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.unit_text import unit_factor
from jointscope.robots.units import OF_SLIDES, UNITS


@pytest.mark.parametrize(
    "unit, into, factor",
    [
        ("mrad", "rad", 1e-3),
        ("um", "mm", 1e-3),
        ("µm", "m", 1e-6),
        ("arcmin", "deg", 1 / 60),
        ("N m", "N m", 1.0),
        ("Nm", "kg m2/s^2", 1.0),
        ("N mm/deg", "N m/rad", 0.18 / math.pi),
        ("rad/(kN m)", "rad/(N m)", 1e-3),
        ("N m s/rad", "N m/(rad/s)", 1.0),
        ("N m s²/rad²", "N m s^2/rad^2", 1.0),
        ("1/N/m", "1/(N m)", 1.0),
        ("rpm", "rad/s", math.pi / 30),
        ("%", "1", 0.01),
        ("g", "m/s^2", 9.80665),
        ("mrad/s/sqrt(s)", "rad/s/sqrt(s)", 1e-3),
        ("V A s", "J", 1.0),
        ("widgets", "widgets", 1.0),
    ],
)
def test_factors(unit, into, factor):
    assert unit_factor(unit, into) == pytest.approx(factor, rel=1e-12)
    assert unit_factor(into, unit) == pytest.approx(1 / factor, rel=1e-12)


@pytest.mark.parametrize(
    "unit", ["N m", "rad/s", "1", "%", "furlong", "", "N m/", "/", "(N", "N)", "()", "N m/rad s", "2 N m", "N m/rad^x"]
)
def test_what_is_no_stiffness_does_not_fit_one(unit):
    assert unit_factor(unit, "N m/rad") is None
    assert unit_factor("N m/rad", unit) is None


def test_every_unit_of_the_house_is_understood():
    of_effects = {p.unit for effect in catalogue().values() for p in effect.parameters}
    for unit in {*of_effects, *OF_SLIDES, *OF_SLIDES.values(), *UNITS}:
        assert unit_factor(unit, f" {unit}") == pytest.approx(1.0), unit
