# SPDX-License-Identifier: BSD-3-Clause
"""Units as people write them, "mrad", "0.3 N m", "rad/(N m)", and the factor from one to another.

A unit is a product of powers; an angle is a dimension of its own, so that a torque is no stiffness. As in robot files
`g` is the acceleration of free fall. After `/` stands one unit, or several in brackets: "N m/rad", "N m/(rad s)".
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field

from jointscope.robots.units import UNITS

_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6}
_PREFIXED = ("m", "rad", "s", "N", "Nm", "V", "A", "Hz", "J", "W")
_BASE: dict[str, dict[str, float]] = {
    **{name: {name: 1.0} for name in ("m", "kg", "s", "A", "rad")},
    "N": {"kg": 1.0, "m": 1.0, "s": -2.0},
    "Nm": {"kg": 1.0, "m": 2.0, "s": -2.0},
    "J": {"kg": 1.0, "m": 2.0, "s": -2.0},
    "W": {"kg": 1.0, "m": 2.0, "s": -3.0},
    "V": {"kg": 1.0, "m": 2.0, "s": -3.0, "A": -1.0},
    "Hz": {"s": -1.0},
    "1": {},
}
_OTHER = {"%": ("1", 0.01), "°": ("rad", math.radians(1.0)), "arcmin": ("rad", math.radians(1 / 60))}
_OTHER |= {"arcsec": ("rad", math.radians(1 / 3600))} | UNITS
_TOKEN = re.compile(r"\s*(sqrt\(s\)|[()/*·]|[A-Za-zµμ°%]+|1)(?:\^?(-?[0-9]+)|([²³]))?\s*")


@dataclass
class _Unit:
    """A factor times powers of base units."""

    factor: float = 1.0
    powers: Counter[str] = field(default_factory=Counter)

    def times(self, other: _Unit, power: float) -> _Unit:
        """This times a power of the other."""
        powers = {base: self.powers[base] + power * other.powers[base] for base in {*self.powers, *other.powers}}
        return _Unit(self.factor * other.factor**power, Counter({b: p for b, p in powers.items() if p}))


def unit_factor(unit: str, into: str) -> float | None:
    """What a value in `unit` is multiplied by to be one in `into`; None if they measure different things.

    A unit that is unknown here, as of a user's effect, fits itself alone.
    """
    if unit == into:
        return 1.0
    one, other = _unit(unit), _unit(into)
    return one.factor / other.factor if one and other and one.powers == other.powers else None


def _unit(text: str) -> _Unit | None:
    try:
        return _product(_tokens(text))
    except (IndexError, KeyError):
        return None


def _tokens(text: str) -> list[tuple[str, float]]:
    """Names, brackets and slashes, each with its power."""
    found, at = [], 0
    while at < len(text):
        token = _TOKEN.match(text, at)
        if token is None:
            raise KeyError(text)
        name, number, raised = token.groups()
        found.append((name, float(number or {"²": 2, "³": 3}.get(raised, 1))))
        at = token.end()
    return found


def _product(tokens: list[tuple[str, float]]) -> _Unit:
    """A product of units; consumes its tokens.

    Raises:
        IndexError, KeyError: the tokens are no unit.
    """
    whole, divided, sign = _Unit(), False, 1.0
    if not tokens:
        raise IndexError
    while tokens:
        name, power = tokens.pop(0)
        if name == "/":
            divided, sign = True, -1.0
            name, power = tokens.pop(0)
        elif name in "*·":
            name, power = tokens.pop(0)
        if divided and sign > 0:
            raise KeyError  # "N/m s": with or without the s above the line?
        if name == "(":
            close = [name for name, _ in tokens].index(")") if (")", 1.0) in tokens else len(tokens)
            inside, (_, power) = tokens[:close], tokens[close]
            del tokens[: close + 1]
            whole = whole.times(_product(inside), sign * power)
        else:
            whole = whole.times(_atom(name), sign * power)
        sign = 1.0
    return whole


def _atom(name: str) -> _Unit:
    if name == "sqrt(s)":
        return _Unit(1.0, Counter({"s": 0.5}))
    if name in _BASE:
        return _Unit(1.0, Counter(_BASE[name]))
    if name in _OTHER:
        si, factor = _OTHER[name]
        return _Unit(factor).times(_product(_tokens(si)), 1.0)
    if name[1:] in _PREFIXED:
        return _Unit(_PREFIXES[name[0]], Counter(_BASE[name[1:]]))
    raise KeyError(name)
