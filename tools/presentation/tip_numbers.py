# SPDX-License-Identifier: BSD-3-Clause
"""Errors of targets as cells of a table: millimetres, and milliradians where orientations were measured."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.poses.tip_errors import TipErrors
from jointscope.tools.presentation.numbers import significant

LABELS = {"mean": "mean", "p90": "90 %", "max": "largest", "rms": "rms"}
USUAL = ("mean", "p90", "max", "rms")


def tip_head(errors: TipErrors, which: Sequence[str] = USUAL) -> list[str]:
    """Heads of the columns.

    Args:
        errors: of which there are orientations or not.
        which: of the keys of LABELS.
    """
    units = ("mm", "mrad") if len(errors.turns) else ("mm",)
    return [f"{LABELS[key]} [{unit}]" for unit in units for key in which]


def tip_cells(errors: TipErrors, which: Sequence[str] = USUAL) -> list[str]:
    """Cells in the order of `tip_head`."""
    found = errors.to_json()
    units = ("mm", "mrad") if len(errors.turns) else ("mm",)
    return [significant(found[f"{key}_{unit}"], 3) for unit in units for key in which]


def target_rows(errors: TipErrors) -> list[tuple[str, TipErrors]]:
    """Errors of each target where there are several, by its name."""
    each = errors.of_targets
    return list(each.items()) if len(each) > 1 else []
