# SPDX-License-Identifier: BSD-3-Clause
"""Reads a mapping of a YAML file strictly: every key is expected, typed and used, or the user is told where."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError

_REQUIRED: Any = object()


class Section:
    """One mapping of a robot file.

    Args:
        content: the mapping.
        place: how the user finds it, for example "doggy.yaml: sensors.imu1".
    """

    def __init__(self, content: Any, place: str):
        if not isinstance(content, Mapping):
            raise RobotError(f"{place}: expected a mapping, got {_show(content)}")
        self._content = content
        self._used: set[str] = set()
        self.place = place

    def __contains__(self, key: str) -> bool:
        return key in self._content

    def keys(self) -> list[str]:
        """All keys, in the order of the file."""
        return [str(key) for key in self._content]

    def number(self, key: str, default: Any = _REQUIRED, positive: bool = False) -> float:
        """A finite number; `positive` demands more than zero."""
        value = self._get(key, default)
        if value is default:
            return value
        if not _is_number(value) or not np.isfinite(float(value)):
            raise RobotError(f"{self._at(key)}: expected a finite number, got {_show(value)}")
        if positive and float(value) <= 0:
            raise RobotError(f"{self._at(key)}: expected a number above zero, got {float(value):g}")
        return float(value)

    def text(self, key: str, default: Any = _REQUIRED, choices: Sequence[str] = ()) -> str:
        """A text, one of `choices` where given."""
        value = self._get(key, default)
        if value is default:
            return value
        if not isinstance(value, str):
            raise RobotError(f"{self._at(key)}: expected a text, got {_show(value)}")
        if choices and value not in choices:
            raise RobotError(f"{self._at(key)}: expected one of {', '.join(choices)}, got {value!r}")
        return str(value)

    def flag(self, key: str, default: Any = _REQUIRED) -> bool:
        """True or false."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise RobotError(f"{self._at(key)}: expected true or false, got {_show(value)}")
        return value

    def texts(self, key: str, default: Any = _REQUIRED) -> tuple[str, ...]:
        """A list of texts."""
        value = self._get(key, default)
        if value is default:
            return value
        if not isinstance(value, Sequence) or isinstance(value, str) or not all(isinstance(v, str) for v in value):
            raise RobotError(f"{self._at(key)}: expected a list of names, got {_show(value)}")
        return tuple(str(v) for v in value)

    def array(self, key: str, shape: tuple[int, ...], default: Any = _REQUIRED) -> NDArray[np.float64]:
        """Finite numbers of the given shape."""
        value = self._get(key, default)
        if value is default:
            return value
        rows = value if len(shape) == 2 else [value]
        numbers = _is_list(rows) and all(_is_list(row) and all(map(_is_number, row)) for row in rows)
        widths = [len(row) for row in rows] if numbers else []
        fits = widths == [shape[-1]] * (shape[0] if len(shape) == 2 else 1)
        array = np.array(rows, dtype=float).reshape(shape) if fits else np.full(1, np.nan)
        if not np.all(np.isfinite(array)):
            size = " x ".join(map(str, shape))
            raise RobotError(f"{self._at(key)}: expected {size} finite numbers, got {_show(value)}")
        return array

    def section(self, key: str, default: Any = _REQUIRED) -> Section:
        """A mapping inside this one."""
        return Section(self._get(key, default), self._at(key))

    def raw(self, key: str, default: Any = None) -> Any:
        """A value without any check."""
        return self._get(key, default)

    def sections(self) -> list[tuple[str, Section]]:
        """All entries as mappings."""
        return [(key, self.section(key)) for key in self.keys()]

    def finish(self) -> None:
        """Complains about the first key that nothing asked for."""
        for key in self.keys():
            if key not in self._used:
                raise RobotError(f"{self.place}: unknown key {key!r}{did_you_mean(key, self._used)}")

    def build(self, make: Callable[[Section], Any]) -> Any:
        """Runs `make` on this section and checks that it used every key."""
        made = make(self)
        self.finish()
        return made

    def _get(self, key: str, default: Any) -> Any:
        self._used.add(key)
        if key in self._content:
            return self._content[key]
        if default is _REQUIRED:
            near = difflib.get_close_matches(key, [k for k in self.keys() if k not in self._used], n=1)
            hint = f"; is {near[0]!r} meant to be it?" if near else ""
            raise RobotError(f"{self.place}: {key!r} is missing{hint}")
        return default

    def _at(self, key: str) -> str:
        return f"{self.place}: {key}" if ": " not in self.place else f"{self.place}.{key}"


def did_you_mean(word: str, known: Sequence[str] | set[str]) -> str:
    """A half sentence that offers the nearest known words, or all of them."""
    near = difflib.get_close_matches(word, list(known), n=1)
    if near:
        return f"; did you mean {near[0]!r}?"
    return f"; expected {', '.join(sorted(known))}" if known else ""


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)


def _show(value: Any) -> str:
    text = repr(value.tolist() if isinstance(value, np.ndarray) else value)
    return text if len(text) <= 60 else text[:57] + "..."
