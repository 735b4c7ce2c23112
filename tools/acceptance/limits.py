# SPDX-License-Identifier: BSD-3-Clause
"""A file of limits: what must hold of a parameter, a channel, a joint or poses, and why.

    limits:
      - {parameter: joint1.stiffness, between: [180, 200], because: data sheet of the belt}
      - {parameter: "*.coulomb_torque", sigma_percent: 2, because: the feed-forward needs it}
      - {parameter: joint1.stiffness, drift_percent: 5, against: january.yaml, because: belt set in January}
      - {channel: "imu1.*", horizon: 0.1, error: 0.02, because: balance controller}

Names may hold `*`; the quantity and its bound are the one key that is left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
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


@dataclass(frozen=True)
class Limit:
    """One line of the file.

    Attributes:
        subject: a key of QUANTITIES.
        pattern: names that it is about; `*` stands for anything.
        quantity: what is limited.
        lower, upper: bounds, in the unit of the quantity.
        reason: why, in the user's words.
        horizon: of the prediction whose error is limited, as JSON has it ("0.1", "open_loop"); empty for others.
        earlier: values of an earlier robot by parameter, where a drift is limited.
        against: the file of that robot.
    """

    subject: str
    pattern: str
    quantity: str
    lower: float
    upper: float
    reason: str
    horizon: str = ""
    earlier: Mapping[str, float] | None = None
    against: str = ""

    @property
    def text(self) -> str:
        """The line in words: "joint1.stiffness between 180 and 200"."""
        what = "" if self.quantity in RANGES else f" {self.quantity}"
        what += f" {self.horizon} s ahead" if self.horizon not in ("", "open_loop") else f" {self.horizon}".rstrip()
        what += f" against {self.against}" if self.against else ""
        if np.isfinite(self.lower) and np.isfinite(self.upper):
            return f"{self.pattern}{what} between {self.lower:g} and {self.upper:g}"
        side, bound = ("at least", self.lower) if np.isfinite(self.lower) else ("at most", self.upper)
        return f"{self.pattern}{what} {side} {bound:g}"


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
    lower, upper = _BOUNDS.get(quantity, _at_most)(section, quantity)
    reason = section.text("because")
    if not reason.strip():
        raise RobotError(f"{section.place}: because: expected the reason for this limit, got an empty text")
    horizon = _horizon(section) if quantity == "error" else ""
    if not quantity.startswith("drift"):
        return Limit(subject, pattern, quantity, lower, upper, reason, horizon)
    against = section.text("against")
    beside = folder / against
    robot = load_robot(beside if beside.is_file() else against)
    earlier = {name: parameter.value for name, parameter in robot.parameters.items()}
    return Limit(subject, pattern, quantity, lower, upper, reason, horizon, earlier, against)


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


def _between(section: Section, key: str) -> tuple[float, float]:
    lower, upper = section.array(key, (2,))
    if lower > upper:
        raise RobotError(f"{section.place}: {key}: expected [lowest, highest], got [{lower:g}, {upper:g}]")
    return float(lower), float(upper)


def _at_most(section: Section, key: str) -> tuple[float, float]:
    return -np.inf, section.number(key)


def _at_least(section: Section, key: str) -> tuple[float, float]:
    return section.number(key), np.inf


_BOUNDS: Mapping[str, Callable[[Section, str], tuple[float, float]]] = {"between": _between, "at_least": _at_least}
