# SPDX-License-Identifier: BSD-3-Clause
"""The `d` of an SVG path as points and what to do at each."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
from matplotlib.path import Path

PART = re.compile(r"([A-Za-z])([^A-Za-z]*)")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
TAKES = {"M": 2, "L": 2, "H": 1, "V": 1, "Z": 0}  # numbers a step; reports draw in straight lines


def path_of(d: str) -> Path:
    """Straight lines of a path in the units of the file.

    Args:
        d: moves and lines, absolute or from the last point.

    Raises:
        ValueError: the path has a curve.
    """
    points, codes = [], []
    for code, point in _steps(d):
        points.append(point)
        codes.append(code)
    return Path(points, codes) if points else Path([(0.0, 0.0)], [Path.MOVETO])


def _steps(d: str) -> Iterator[tuple[np.uint8, tuple[float, float]]]:
    x = y = 0.0
    begin = (x, y)
    for letter, text in PART.findall(d):
        numbers = [float(number) for number in NUMBER.findall(text)]
        kind = letter.upper()
        if kind not in TAKES:
            raise ValueError(f"path with {letter!r}: expected one of {', '.join(TAKES)}")
        if kind == "Z":
            x, y = begin
            yield Path.CLOSEPOLY, begin
            continue
        for k in range(0, len(numbers), TAKES[kind]):
            step = dict(zip("xy" if TAKES[kind] == 2 else ("x" if kind == "H" else "y"), numbers[k:], strict=False))
            if letter.islower():
                x, y = x + step.get("x", 0.0), y + step.get("y", 0.0)
            else:
                x, y = step.get("x", x), step.get("y", y)
            if kind == "M" and not k:
                begin = (x, y)
                yield Path.MOVETO, begin
            else:
                yield Path.LINETO, (x, y)
