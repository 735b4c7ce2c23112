# SPDX-License-Identifier: BSD-3-Clause
"""What poses say a model lacks: the ranking of effects, and the steps of a discovery."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.poses.discover_poses import PoseCandidate, PoseDiscovery
from jointscope.graphs.poses.tip_errors import TipErrors, summary
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.terminal.text_table import text_table

SHOWN = 8
TOLD = ("p90_mm", "max_mm")


def pose_ranking_text(candidates: Sequence[PoseCandidate], count: int) -> str:
    """The effects that were looked at, best first."""
    rows = []
    for c in candidates[:SHOWN]:
        gain, helped = f"{100.0 * c.gain:.1f} %", f"{100.0 * c.helped:.0f} %"
        alike = ", ".join(c.look_alikes)
        rows.append([c.hypothesis.label, c.verdict, significant(c.score, 3), f"{c.p_value:.1g}", gain, helped, alike])
    head = ["effect", "verdict", "chi2 falls by", "p", "left-out poses better by", "of the folds", "look-alikes"]
    told = (
        f"{count} poses; {len(candidates)} effects were fitted to nine tenths of them and judged by the rest, in turn"
    )
    return f"{told}\n{text_table(head, rows, '<<>>>><')}"


def pose_discovery_text(found: PoseDiscovery) -> str:
    """The steps, and what was looked at last."""
    head, rows = step_table(found)
    last = found.steps[-1]
    alike = [
        f"{step.added.hypothesis.label} cannot be told from {', '.join(step.added.look_alikes)} by these poses"
        for step in found.steps[1:]
        if step.added is not None and step.added.look_alikes
    ]
    parts = [
        text_table(head, rows, "<<" + ">" * (len(head) - 2)),
        f"It ended because {found.stop_reason}.",
        *alike,
        pose_ranking_text(last.candidates, last.result.count),
    ]
    return "\n\n".join(parts)


def step_table(found: PoseDiscovery) -> tuple[list[str], list[list[str]]]:
    """Names of the columns, and a row per step; those of poses that were held out only where there are any."""
    head, rows = ["step", "added", "90 % [mm]", "largest [mm]"], []
    if found.holdout:
        head += ["held out: 90 % [mm]", "largest [mm]"]
    for k, step in enumerate(found.steps):
        seen: list[TipErrors | None] = [summary(step.result.errors), step.heldout]
        cells = [significant(each.to_json()[key], 3) for each in seen if each is not None for key in TOLD]
        rows.append([str(k), step.added.hypothesis.label if step.added else "base model", *cells])
    return head, rows
