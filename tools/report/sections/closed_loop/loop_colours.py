# SPDX-License-Identifier: BSD-3-Clause
"""One colour per way of knowing the state, the same in every section about closed loops."""

from __future__ import annotations

from collections.abc import Iterable

from jointscope.tools.closed_loop.closed_loop_result import CONTROLLERS, SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.report.page.page import Key

COLOURS = {"true": "m2", "estimator": "m0", "encoders": "m1"}


def source_keys(runs: Iterable[LoopRun]) -> list[Key]:
    """Legend entries of the sources of some runs."""
    return [Key(SOURCES[run.source], COLOURS[run.source]) for run in runs]


def by_controller(result: ClosedLoopResult) -> list[tuple[str, list[LoopRun]]]:
    """Title and runs of every controller, the one that knows most first."""
    names = [name for name in reversed(CONTROLLERS) if any(run.controller == name for run in result.runs)]
    titles = {name: f"{told[0].upper()}{told[1:]}" for name, told in CONTROLLERS.items()} | {"p": "P-controller"}
    return [(titles[name], [run for run in result.runs if run.controller == name]) for name in names]


def swatch(run: LoopRun) -> str:
    """Source of a run with its colour, as HTML."""
    colour = f'<span class="{COLOURS[run.source]}"><i class="swatch coloured"></i></span>'
    return f'<span class="nowrap">{colour}{SOURCES[run.source]}</span>'
