# SPDX-License-Identifier: BSD-3-Clause
"""A file of limits: what must hold of a parameter, a channel, a joint or poses, and why.

    limits:
      - {parameter: joint1.stiffness, between: [180, 200 N m/rad], because: data sheet of the belt}
      - {parameter: "*.coulomb_torque", sigma_percent: 2, because: the feed-forward needs it}
      - {parameter: joint1.stiffness, drift_percent: 5, against: january.yaml, because: belt set in January}
      - {channel: "imu1.*", horizon: 0.1, error: 1 deg/s, because: balance controller}

Names may hold `*`; the quantity and its bound are the one key that is left. A bound has a unit unless it is a pure
number or the quantity names its unit: nothing must pass because it was meant in another one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.unit_text import unit_factor
from jointscope.robots.yaml_document import read_document
from jointscope.robots.yaml_section import Section, did_you_mean

BESIDE = ("because", "horizon", "against")  # keys that say more of a limit
RANGES = ("between", "at_most", "at_least")
QUANTITIES: Mapping[str, tuple[str, ...]] = {
    "parameter": (*RANGES, "sigma", "sigma_percent", "drift", "drift_percent"),
    "channel": ("rmse", "chi2", "error"),
    "joint": ("missing_torque_percent",),
    "poses": ("mean_mm", "p90_mm", "max_mm", "rms_mm", "mean_mrad", "p90_mrad", "max_mrad", "rms_mrad"),
}
"""What can be limited, by what it is of."""
_OWN_UNITS = {"percent": "%", "mm": "mm", "mrad": "mrad", "chi2": "1"}
_BOUND = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*")


def own_unit(quantity: str) -> str | None:
    """The unit that the last word of a quantity says, if it says one."""
    return _OWN_UNITS.get(quantity.rsplit("_", 1)[-1])


@dataclass(frozen=True)
class Limit:
    """One line of the file.

    Attributes:
        subject: a key of QUANTITIES.
        pattern: names that it is about; `*` stands for anything.
        quantity: what is limited.
        lower, upper: bounds, in `unit`.
        reason: why, in the user's words.
        unit: of the bounds; empty where they are pure numbers.
        horizon: of the prediction whose error is limited, as JSON has it ("0.1", "open_loop"); empty for others.
        earlier: parameters of an earlier robot by name, where a drift is limited.
        against: the file of that robot.
        place: where it stands, for messages: "limits.yaml: limits[2]".
    """

    subject: str
    pattern: str
    quantity: str
    lower: float
    upper: float
    reason: str
    unit: str = ""
    horizon: str = ""
    earlier: Mapping[str, Parameter] | None = None
    against: str = ""
    place: str = ""

    @property
    def in_own_unit(self) -> bool:
        """Whether the name of the quantity says its unit."""
        return own_unit(self.quantity) is not None

    def factor_from(self, unit: str) -> float | None:
        """What a value in `unit` is multiplied by to be one in the unit of the bounds; None if that does not fit."""
        only_zero = not self.unit and all(b == 0.0 or np.isinf(b) for b in (self.lower, self.upper))
        return 1.0 if only_zero else unit_factor(unit or "1", self.unit or "1")

    def misfit(self, unit: str, name: str = "") -> str:
        """The message for bounds whose unit does not fit what is limited, of that name, which is in `unit`."""
        bound = self.upper if np.isfinite(self.upper) and self.upper else self.lower
        got = f"{bound:g} {self.unit}" if self.unit else f"{bound:g} without a unit"
        of = f"{self.quantity} of {name}" if name else self.quantity
        return f"{self.place}: {of} is in {unit}; expected a bound in such a unit, as '{bound:g} {unit}', got {got!r}"

    @property
    def bounds(self) -> str:
        """The bounds in words: "between 180 and 200 N m/rad"."""
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        if np.isfinite(self.lower) and np.isfinite(self.upper):
            return f"between {self.lower:g} and {self.upper:g}{unit}"
        side, bound = ("at least", self.lower) if np.isfinite(self.lower) else ("at most", self.upper)
        return f"{side} {bound:g}{unit}"

    @property
    def text(self) -> str:
        """The line in words: "joint1.stiffness between 180 and 200 N m/rad"."""
        what = "" if self.quantity in RANGES else f" {self.quantity}"
        what += f" {self.horizon} s ahead" if self.horizon not in ("", "open_loop") else f" {self.horizon}".rstrip()
        what += f" against {self.against}" if self.against else ""
        return f"{self.pattern}{what} {self.bounds}"


def read_limits(path: Path) -> tuple[Limit, ...]:
    """The limits of a file.

    Raises:
        RobotError: it cannot be read, a line has a mistake, or an earlier robot cannot be read.
    """
    document = Section(read_document(path, "limits file"), path.name)
    lines = document.raw("limits")
    document.finish()
    if not isinstance(lines, list) or not lines:
        raise RobotError(f"{path.name}: expected a list `limits` with at least one line")
    return tuple(
        Section(line, f"{path.name}: limits[{number}]").build(lambda section: _limit(section, path.parent))
        for number, line in enumerate(lines, start=1)
    )


def _limit(section: Section, folder: Path) -> Limit:
    subject = _only_key(section, tuple(QUANTITIES), "what the limit is of")
    pattern = section.text(subject)
    quantity = _only_key(section, QUANTITIES[subject], f"what is limited of a {subject}")
    lower, upper, unit = read_bounds(section, quantity)
    limit = Limit(subject, pattern, quantity, lower, upper, _reason(section), unit, place=section.place)
    if quantity == "error":
        limit = replace(limit, horizon=_horizon(section))
    if quantity.startswith("drift"):
        limit = replace(limit, **_earlier(section, folder))
    return _with_own_unit(limit)


def _reason(section: Section) -> str:
    reason = section.text("because")
    if not reason.strip():
        raise RobotError(f"{section.place}: because: expected the reason for this limit, got an empty text")
    return reason


def _earlier(section: Section, folder: Path) -> dict[str, Any]:
    """The robot that a drift is measured from."""
    against = section.text("against")
    beside = folder / against
    return {"earlier": load_robot(beside if beside.is_file() else against).parameters, "against": against}


def _with_own_unit(limit: Limit) -> Limit:
    """With the unit that the quantity's name says; complains about another, and about percents of an absolute one."""
    own = own_unit(limit.quantity)
    if own is not None and not limit.unit:
        return replace(limit, unit=own)
    if own is not None and limit.factor_from(own) is None:
        raise RobotError(limit.misfit(own))
    if limit.quantity in ("sigma", "drift") and limit.unit == "%":
        raise RobotError(
            f"{limit.place}: {limit.quantity}: of percents write `{limit.quantity}_percent: {limit.upper:g}`"
        )
    return limit


def _only_key(section: Section, known: tuple[str, ...], what: str) -> str:
    found = [key for key in section.keys() if key in known]
    if len(found) != 1:
        odd = [key for key in section.keys() if key not in (*QUANTITIES, *BESIDE)]
        hint = did_you_mean(odd[0], set(known)) if odd and not found else ""
        raise RobotError(
            f"{section.place}: expected one of {', '.join(known)} ({what}), got {' and '.join(found) or 'none'}{hint}"
        )
    return found[0]


def _horizon(section: Section) -> str:
    value = section.raw("horizon")
    if value == "open_loop":
        return "open_loop"
    return f"{float(section.number('horizon', positive=True))}"


def read_bounds(section: Section, quantity: str) -> tuple[float, float, str]:
    """Lowest and highest value that a limit allows, and their unit, empty where none is written.

    Raises:
        RobotError: it is no number, or no pair of numbers.
    """
    return _READ.get(quantity, _at_most)(section, quantity)


def _between(section: Section, key: str) -> tuple[float, float, str]:
    pair = section.raw(key)
    if not isinstance(pair, Sequence) or isinstance(pair, str) or len(pair) != 2:
        raise RobotError(f"{section.place}: {key}: expected [lowest, highest], got {pair!r}")
    (lower, first), (upper, unit) = (_bound(section, key, value) for value in pair)
    if first and unit != first:
        factor = unit_factor(unit or "1", first)
        if factor is None:
            raise RobotError(
                f"{section.place}: {key}: expected two bounds of one unit, got {pair[0]!r} and {pair[1]!r}"
            )
        upper, unit = factor * upper, first
    if lower > upper:
        raise RobotError(f"{section.place}: {key}: expected [lowest, highest], got [{pair[0]}, {pair[1]}]")
    return lower, upper, unit


def _at_most(section: Section, key: str) -> tuple[float, float, str]:
    return -np.inf, *_bound(section, key, section.raw(key))


def _at_least(section: Section, key: str) -> tuple[float, float, str]:
    value, unit = _bound(section, key, section.raw(key))
    return value, np.inf, unit


def _bound(section: Section, key: str, value: Any) -> tuple[float, str]:
    """A number and its unit, from 0.3, "0.3 N m" or "55 um"; no unit is an empty text."""
    if isinstance(value, str):
        parts = _BOUND.fullmatch(value)
        if parts is not None and np.isfinite(float(parts[1])):
            return float(parts[1]), parts[2]
    elif isinstance(value, Real) and not isinstance(value, bool) and np.isfinite(float(value)):
        return float(value), ""
    raise RobotError(f"{section.place}: {key}: expected a number with its unit, such as '0.3 N m', got {value!r}")


_READ: Mapping[str, Callable[[Section, str], tuple[float, float, str]]] = {"between": _between, "at_least": _at_least}


def check_units(limits: Sequence[Limit], robots: Iterable[Robot]) -> None:
    """Complains about the first bound that is in no unit of a parameter or channel that it is for.

    Raises:
        RobotError: a unit does not fit, or a bound has none where the quantity has a dimension.
    """
    for robot in robots:
        for limit in limits:
            for name, unit in _own_units(limit, robot):
                if fnmatchcase(name, limit.pattern) and limit.factor_from(unit) is None:
                    raise RobotError(limit.misfit(unit, name))


def _own_units(limit: Limit, robot: Robot) -> Iterator[tuple[str, str]]:
    """Names and units of all that a limit may be about; nothing where its quantity says its unit."""
    if limit.in_own_unit:
        return
    if limit.subject == "parameter":
        yield from ((name, parameter.unit) for name, parameter in robot.parameters.items())
        yield from ((derived.name, derived.unit) for derived in robot.derived)
    if limit.subject == "channel":
        for sensor in robot.sensors.values():
            yield from zip(sensor.channels, sensor.units, strict=True)
