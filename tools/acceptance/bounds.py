# SPDX-License-Identifier: BSD-3-Clause
"""Bounds of a limit as users write them: `0.3 N m`, `55 um`, `[180, 200 N m/rad]`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np

from jointscope.robots.errors import RobotError
from jointscope.robots.unit_text import unit_factor
from jointscope.robots.yaml_section import Section

_BOUND = re.compile(r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*")


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
