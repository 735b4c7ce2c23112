# SPDX-License-Identifier: BSD-3-Clause
"""What one linear step says of a value: a number as long as it is near, else only that the value would be another."""

from __future__ import annotations

from jointscope.tools.presentation.numbers import significant

LONG = 0.5  # of a value, beyond which one linear step does not say where it ends


def would_be(name: str, value: float, other: float, unit: str) -> str:
    """A clause on a value and on what a step makes of it."""
    if abs(other - value) > LONG * abs(value):
        return f"{name} would change by more than half"
    return f"{name} would be about {significant(other)} instead of {significant(value)} {unit}"
