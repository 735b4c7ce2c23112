# SPDX-License-Identifier: BSD-3-Clause
"""Limits against what a verb found, as its JSON has it: pass, fail or not evaluated, and never a pass by silence.

A value passes if it is inside its limits with two standard deviations to spare, and fails if it is outside; in between
nobody can tell (the decision rule of ISO 14253-1). What the result lacks is not evaluated, nor is anything of a
calibration that has not converged, and nothing passes of one whose own verdict is "No".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import Any

from jointscope.graphs.comparison.predictions_ahead import HORIZONS
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.acceptance.limits import RANGES, Limit

PASS, FAIL, OPEN = "pass", "fail", "not evaluated"
FAILED, UNDECIDED = 3, 4  # exit codes
CERTAIN = 2.0  # sigma
AXES = "xyz"
TABLES = {"parameter": "parameters", "channel": "channels", "joint": "missing_torque_percent"}
"""Where in the JSON the names of a subject stand."""
NO_TORQUE = (
    "this result has no missing_torque_percent: `jointscope diagnose` finds it if encoders on rigid joints "
    "tell torques; elsewhere models are judged by predictions, which `channel` with a `horizon` limits"
)


@dataclass(frozen=True)
class Checked:
    """One limit on one name.

    Attributes:
        limit: the limit.
        name: what it was checked on; the pattern where nothing was found.
        outcome: PASS, FAIL or OPEN.
        found: the value with its unit, or why there is none.
    """

    limit: Limit
    name: str
    outcome: str
    found: str

    def to_json(self) -> dict[str, str]:
        """The same for machines."""
        return {
            "name": self.name,
            "limit": self.limit.text,
            "because": self.limit.reason,
            "outcome": self.outcome,
            "found": self.found,
        }


@dataclass(frozen=True)
class _Found:
    """A number of the result, or why there is none."""

    value: float = math.nan
    unit: str = ""
    sigma: float = 0.0
    missing: str = ""
    remark: str = ""


AcceptedBy = Mapping[str, Sequence[Checked]]
"""Lines by the label of the model."""
NO_LIMITS: AcceptedBy = MappingProxyType({})


def check_limits(limits: Sequence[Limit], content: Mapping[str, Any]) -> tuple[Checked, ...]:
    """All limits against one result.

    Args:
        limits: of `read_limits`.
        content: of the JSON of `calibrate`, or of one model of `compare`.
    """
    checked = tuple(checked for limit in limits for checked in _check(limit, content))
    if content.get("verdict", {}).get("level") != "bad":
        return checked
    return tuple(_not_relied_on(line) if line.outcome == PASS else line for line in checked)


def check_models(limits: Sequence[Limit], models: Mapping[str, Mapping[str, Any]]) -> AcceptedBy:
    """The lines of each model, by its label; nothing without limits.

    Args:
        limits: as given.
        models: what JSON says of each.
    """
    return {label: check_limits(limits, content) for label, content in models.items()} if limits else NO_LIMITS


def acceptance_json(checked: AcceptedBy) -> dict[str, Any]:
    """What is added to the JSON: lines by model; nothing without limits."""
    lines = {label: [line.to_json() for line in lines] for label, lines in checked.items()}
    return {"acceptance": lines} if lines else {}


def exit_code(checked: Sequence[Checked]) -> int:
    """0 if everything passed, FAILED if anything failed, else UNDECIDED."""
    outcomes = {line.outcome for line in checked}
    return FAILED if FAIL in outcomes else UNDECIDED if OPEN in outcomes else 0


def _not_relied_on(line: Checked) -> Checked:
    """What would pass, of a result that says itself that it must not be relied on."""
    return replace(line, outcome=OPEN, found=f"{line.found}; but the verdict above is “No”")


def _check(limit: Limit, content: Mapping[str, Any]) -> Iterator[Checked]:
    if content.get("converged") is False:
        yield Checked(limit, limit.pattern, OPEN, "the calibration has not converged, so its values mean nothing")
        return
    if limit.subject == "poses":
        yield _judged(limit, limit.quantity, _of_poses(limit, content))
        return
    table = content.get(TABLES[limit.subject])
    if not table:
        nothing = f"this result has no {TABLES[limit.subject]}"
        yield Checked(limit, limit.pattern, OPEN, NO_TORQUE if limit.subject == "joint" else nothing)
        return
    if limit.subject == "parameter":
        table = dict(_single_numbers(table, limit.pattern))
    names = [name for name in table if fnmatchcase(name, limit.pattern)]
    for name in names:
        yield _judged(limit, name, _READ[limit.subject](limit, name, table[name]))
    if not names:
        near = did_you_mean(limit.pattern, set(table))
        yield Checked(limit, limit.pattern, OPEN, f"there is no such {limit.subject}{near}")


def _single_numbers(table: Mapping[str, Any], pattern: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Parameters as the screen names them: of biases and mountings the three axes, unless they are named as a whole.

    A mounting is a matrix, with sigmas of three angles: these can be limited, the angles themselves are nowhere.
    """
    for name, entry in table.items():
        values = entry["value"]
        if not isinstance(values, list) or len(values) != len(AXES) or name == pattern:
            yield name, entry
            continue
        for axis, value, sigma in zip(AXES, values, entry["sigma"] or [None] * len(AXES), strict=True):
            unit = "rad" if isinstance(value, list) else entry["unit"]
            yield f"{name}.{axis}", {"value": value, "sigma": sigma, "unit": unit}


def _judged(limit: Limit, name: str, found: _Found) -> Checked:
    if found.missing:
        return Checked(limit, name, OPEN, found.missing)
    factor = limit.factor_from(found.unit)
    if factor is None:
        return Checked(limit, name, OPEN, f"it is in {found.unit or 'no unit'}, the limit {_in(limit.unit)}")
    value, spread, unit = factor * found.value, CERTAIN * factor * found.sigma, limit.unit or found.unit
    text = f"{value:.6g} {'' if unit == '1' else unit}".rstrip()
    text += f" ± {factor * found.sigma:.2g}" if found.sigma else ""
    text += f", {found.remark}" if found.remark else ""
    if not limit.lower <= value <= limit.upper:
        return Checked(limit, name, FAIL, text)
    if not (
        limit.lower <= value - spread and value + spread <= limit.upper
    ):  # a sigma that is no number passes nowhere
        return Checked(limit, name, OPEN, f"{text}: two sigma reach beyond the limit")
    return Checked(limit, name, PASS, text)


def _in(unit: str) -> str:
    return f"in {unit}" if unit else "has no unit"


def _of_parameter(limit: Limit, name: str, entry: Mapping[str, Any]) -> _Found:
    value, sigma, unit = entry["value"], entry["sigma"], entry["unit"]
    if isinstance(value, list) and limit.quantity == "sigma" and isinstance(sigma, int | float):
        return _Found(sigma, unit)
    if sigma is None:
        return _Found(missing="it was held, not calibrated")
    if not isinstance(value, int | float):
        axes = ", ".join(f"{name}.{axis}" for axis in AXES)
        which = f": its sigma can be limited, in {unit}" if isinstance(sigma, int | float) else f": name one of {axes}"
        return _Found(missing=f"it is no single number{which}")
    if limit.quantity in RANGES:
        return _Found(value, unit, sigma)
    if limit.quantity.startswith("sigma"):
        return _share(sigma, value, unit, limit.quantity)
    assert limit.earlier is not None
    before = limit.earlier.get(name)
    if before is None or before.unit != unit:
        return _Found(missing=f"{limit.against} has no such parameter{'' if before is None else f' in {unit}'}")
    return _drift(limit.quantity, before, value, sigma)


def _drift(quantity: str, before: Parameter, value: float, sigma: float) -> _Found:
    """How far a value has moved, with the sigmas of both.

    What both have in common, priors and the masses of the URDF, cancels in the difference, and so would noise of
    recordings that both were found from: the sigma of independent values is the larger one.
    """
    was, past = before.value, before.sigma or 0.0
    moved = _share(abs(value - was), was, before.unit, quantity)
    if moved.missing:
        return moved
    relative = quantity.endswith("_percent")
    spread = 100.0 * math.hypot(sigma, past * value / was) / abs(was) if relative else math.hypot(sigma, past)
    said = f"{was:.6g} ± {past:.2g}" if past else f"{was:.6g} (no sigma: taken as exact)"
    remark = f"from {said} to {value:.6g} ± {sigma:.2g} {before.unit}"
    return replace(moved, sigma=spread, remark=remark)


def _share(part: float, whole: float, unit: str, quantity: str) -> _Found:
    """A part in its unit, or in percent of the whole, as the quantity says."""
    if not quantity.endswith("_percent"):
        return _Found(part, unit)
    return _Found(100.0 * part / abs(whole), "%") if whole else _Found(missing="there are no percent of zero")


def _of_channel(limit: Limit, _: str, entry: Mapping[str, Any]) -> _Found:
    if limit.quantity == "error":
        horizons = entry.get("horizons", {})
        if limit.horizon not in horizons:
            ahead = ", ".join(map(str, HORIZONS))
            known = (
                f"; horizons are {', '.join(horizons)}"
                if horizons
                else f"; `jointscope compare` has {ahead}, open_loop"
            )
            asked = "in the open loop" if limit.horizon == "open_loop" else f"{limit.horizon} s ahead"
            return _Found(missing=f"this result has no error {asked}{known}")
        return _number(horizons[limit.horizon], entry.get("unit", ""))
    if limit.quantity not in entry:
        return _Found(missing=f"this result has no {limit.quantity}; `jointscope calibrate` has it")
    return _number(entry[limit.quantity], "1" if limit.quantity == "chi2" else entry.get("unit", ""))


def _of_joint(_: Limit, name: str, entry: float | None) -> _Found:
    return _number(entry, "%", f"the drive of {name} has no torque unit, or none was judged")


def _of_poses(limit: Limit, content: Mapping[str, Any]) -> _Found:
    found = content.get("poses", {})
    sessions = [found] if isinstance(found, Mapping) else found  # a calibration has one entry for each session
    values = [session.get(limit.quantity) for session in sessions]
    known = [value for value in values if isinstance(value, int | float)]
    worst = max(known) if known and len(known) == len(values) else None
    unit = limit.quantity.rpartition("_")[2]
    what = "poses" if unit == "mm" else "orientations of poses"
    return _number(worst, unit, f"this result has no {what}")


def _number(value: Any, unit: str = "", otherwise: str = "it is no number") -> _Found:
    return _Found(float(value), unit) if isinstance(value, int | float) else _Found(missing=otherwise)


_READ: Mapping[str, Callable[[Limit, str, Any], _Found]] = {
    "parameter": _of_parameter,
    "channel": _of_channel,
    "joint": _of_joint,
}
