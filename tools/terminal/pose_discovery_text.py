# SPDX-License-Identifier: BSD-3-Clause
"""What poses say a model lacks: the ranking of effects, and the steps of a discovery."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.poses.discover_poses import PoseCandidate, PoseDiscovery, PoseStep
from jointscope.graphs.poses.tip_errors import summary
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.terminal.text_table import text_table

SHOWN = 8


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
    held = bool(found.holdout)
    head = ["step", "added", "90 % [mm]", "largest [mm]", *(["held out: 90 % [mm]", "largest [mm]"] if held else [])]
    rows = [_row(k, step, held) for k, step in enumerate(found.steps)]
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


def _row(number: int, step: PoseStep, held: bool) -> list[str]:
    mm = summary(step.result.errors).to_json()
    cells = [significant(mm["p90_mm"], 3), significant(mm["max_mm"], 3)]
    if held and step.heldout is not None:
        other = step.heldout.to_json()
        cells += [significant(other["p90_mm"], 3), significant(other["max_mm"], 3)]
    return [str(number), step.added.hypothesis.label if step.added else "base model", *cells]
