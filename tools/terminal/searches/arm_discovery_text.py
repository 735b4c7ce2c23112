# SPDX-License-Identifier: BSD-3-Clause
"""What poses and frequency responses say a model lacks: the ranking of effects, and the steps of a discovery."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.joint_kinds.arm_candidates import Calibrated
from jointscope.graphs.joint_kinds.discover_arm import ArmDiscovery, ArmStep
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate
from jointscope.graphs.poses.tip_errors import TipErrors, summary
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import fall_text, percent, significant
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verdicts.pose_judgement import moved_during

SHOWN = 8
MOST_TIMES = 4.0  # as many poses: more than these are no advice
TOLD = ("p90_mm", "max_mm")
WORDS = {POSES: "poses", FREQUENCY: "responses"}
ALONE = {POSES: "poses alone", FREQUENCY: "frequency responses alone"}
WITH = {POSES: "with poses", FREQUENCY: "with frequency responses"}


def ranking_text(candidates: Sequence[ArmCandidate], said: str, kinds: Sequence[str]) -> str:
    """The effects that were looked at, best first.

    Args:
        candidates: all of them.
        said: what they were fitted to.
        kinds: of recordings that were used.
    """
    rows = []
    for c in candidates[:SHOWN]:
        row = [c.hypothesis.label, c.verdict, fall_text(c.score), f"{c.p_value:.1g}"]
        for kind in kinds:
            gain = c.gains.get(kind)
            row += ["-", "-"] if gain is None else [f"{100.0 * gain.share:.1f} %", f"{100.0 * gain.helped:.0f} %"]
        shown_by = c.shown_by if c.verdict == "missing" else ()
        shown = [", ".join(WORDS[kind] for kind in shown_by)] if len(kinds) > 1 else []
        rows.append([*row, *shown, ", ".join(c.look_alikes)])
    head = ["effect", "verdict", "chi2 falls by", "p"]
    for kind in kinds:
        head += [f"left-out {WORDS[kind]} better by", "of the folds"]
    head += [*(["shown by"] if len(kinds) > 1 else []), "look-alikes"]
    told = f"{said}; {len(candidates)} effects were fitted to all but one fold of them and judged by that, in turn"
    sides = "<<>>" + ">>" * len(kinds) + ("<<" if len(kinds) > 1 else "<")
    return f"{told}\n{text_table(head, rows, sides)}"


def explained_sentences(candidates: Sequence[ArmCandidate]) -> list[str]:
    """Effects that would be missing if the likeliest one were not; none where there is nothing of that sort."""
    explained = [c for c in candidates if c.verdict == "possible" and c.explained_by]
    if not explained:
        return []
    labels = ", ".join(c.hypothesis.label for c in explained[:SHOWN])
    return [
        f"{explained[0].explained_by} explains what these would: {labels}. `jointscope discover` with the same "
        "recordings adds it and asks again."
    ]


def told_apart(candidate: ArmCandidate) -> list[str]:
    """What each kind alone would have said of an effect, where all kinds together know more."""
    found = []
    label, together = candidate.hypothesis.label, {*candidate.look_alikes}
    kinds = tuple(candidate.gains)
    for kind, names in candidate.alone.items():
        others = [k for k in kinds if k != kind]
        if others and set(names) - together:
            rest = " or ".join([label, *candidate.look_alikes])
            found.append(f"{ALONE[kind]}: {' or '.join([label, *names])}; {WITH[others[0]]}: {rest}")
    return found


def unseen_sentences(candidates: Sequence[ArmCandidate], kinds: Sequence[str]) -> list[str]:
    """Effects that one of the kinds cannot show, and why."""
    found: dict[tuple[str, str], list[str]] = {}
    for c in candidates:
        for kind in kinds:
            if kind in c.hypothesis.kind.unseen and c.hypothesis.kind.id not in found.setdefault(
                (kind, c.hypothesis.kind.unseen[kind]), []
            ):
                found[kind, c.hypothesis.kind.unseen[kind]].append(c.hypothesis.kind.id)
    return [f"{', '.join(ids)} not testable by {WORDS[kind]}: {why}" for (kind, why), ids in found.items() if ids]


def moved_sentences(calibration: Calibrated) -> list[str]:
    """What moved during a session, for which effects may stand in; nothing where all stayed."""
    step = None if calibration.poses is None else moved_during(calibration.poses)
    return [] if step is None else [f"! {step.text}; until then what is listed here may stand in for it."]


def limit_sentences(step: ArmStep) -> list[str]:
    """What more poses would tell, and how large effects must be to show in these; nothing with other recordings."""
    if step.calibrated.poses is None or step.calibrated.frequency is not None or moved_sentences(step.calibrated):
        return []
    count, said = step.result.count, list[str]()
    looked = [c for c in step.candidates if c.verdict not in ("missing", "untestable")]
    hinted = sorted((c for c in looked if c.times < MOST_TIMES), key=lambda c: c.times)
    if hinted and not any(c.verdict == "missing" for c in step.candidates):  # or they may stand in for that one
        each = (f"{c.hypothesis.label} ({_size(c, c.sizes)}) with about {_more(c, count)} more" for c in hinted)
        said.append(f"More poses would tell: {', '.join(each)} like these, if it is there.")
    smallest: dict[str, list[ArmCandidate]] = {}
    for c in looked:
        smallest.setdefault(c.hypothesis.kind.id, []).append(c)
    if smallest:
        each = (f"{kind} below {_range([c.smallest for c in found], found[0])}" for kind, found in smallest.items())
        said.append(
            f"In {counted(count, 'pose')}, with what this model leaves, these would not show, depending on the joint: "
            f"{', '.join(each)}; four times as many poses show half as much."
        )
    return said


def _more(candidate: ArmCandidate, count: int) -> int:
    return max(int(np.ceil((candidate.times - 1.0) * count)), 1)


def _size(candidate: ArmCandidate, sizes: Sequence[float]) -> str:
    return f"{significant(float(np.linalg.norm(sizes)), 2)} {_unit(candidate)}"


def _range(sizes: Sequence[float], candidate: ArmCandidate) -> str:
    low, high = (significant(size, 2) for size in (min(sizes), max(sizes)))
    return f"{low if low == high else f'{low} to {high}'} {_unit(candidate)}"


def _unit(candidate: ArmCandidate) -> str:
    return "rad/(N m)" if candidate.hypothesis.kind.soft else candidate.hypothesis.kind.unit


def arm_discovery_text(found: ArmDiscovery) -> str:
    """The steps, and what was looked at last."""
    head, rows = step_table(found)
    last, said = found.steps[-1], list[str]()
    for step in found.steps[1:]:
        if step.added is None:
            continue
        label = step.added.hypothesis.label
        if len(found.kinds) > 1 and step.added.shown_by:
            said.append(f"{label} is shown by {' and '.join(WORDS[kind] for kind in step.added.shown_by)}")
        if step.added.look_alikes:
            these = "these poses" if found.kinds == (POSES,) else "these recordings"
            said.append(f"{label} cannot be told from {', '.join(step.added.look_alikes)} by {these}")
        said += told_apart(step.added)
    parts = [
        *moved_sentences(found.steps[0].calibrated),
        text_table(head, rows, "<<" + ">" * (len(head) - 2)),
        f"The search ended because {found.stop_reason}.",
        *said,
        ranking_text(last.candidates, recordings_said(found), found.kinds),
        *unseen_sentences(last.candidates, found.kinds if len(found.kinds) > 1 else ()),
        *limit_sentences(last),
    ]
    return "\n\n".join(parts)


def heldout_table(found: ArmDiscovery) -> list[str]:
    """Errors of a model that was diagnosed beside those on recordings that were held out; nothing without any."""
    if not (found.holdout or found.steps[0].shaken):
        return []
    head, rows = step_table(found)
    return [text_table(head[1:], [row[1:] for row in rows], "<" + ">" * (len(head) - 2))]


def recordings_said(found: ArmDiscovery) -> str:
    """How much was fitted."""
    last = found.steps[-1].calibrated
    counts = [] if last.poses is None else [counted(last.poses.count, "pose")]
    if last.frequency is not None:
        counts.append(f"{len(last.frequency.problems)} recordings of the arm shaken")
    return " and ".join(counts)


def step_table(found: ArmDiscovery) -> tuple[list[str], list[list[str]]]:
    """Names of the columns, and a row per step; those of recordings that were held out only where there are any."""
    head, rows = ["step", "model"], []
    if POSES in found.kinds:
        head += ["90 % [mm]", "largest [mm]", *(["held out: 90 % [mm]", "largest [mm]"] if found.holdout else [])]
    shaken = bool(found.steps[-1].shaken)
    if FREQUENCY in found.kinds:
        head += ["torques left", *(["held out: torques left"] if shaken else [])]
    for k, step in enumerate(found.steps):
        row = [str(k), step.added.hypothesis.label if step.added else "base model"]
        if POSES in found.kinds:
            seen: list[TipErrors | None] = [summary(step.result.errors), step.heldout]
            row += [significant(each.to_json()[key], 3) for each in seen if each is not None for key in TOLD]
        if FREQUENCY in found.kinds:
            row += [percent(step.left), *([percent(step.left_heldout)] if shaken else [])]
        rows.append(row)
    return head, rows
