# SPDX-License-Identifier: BSD-3-Clause
"""What several kinds of recordings say of the effects that a model lacks, on one screen."""

from __future__ import annotations

from jointscope.graphs.across_kinds.diagnose_kinds import KindsDiagnosis
from jointscope.graphs.across_kinds.said_by_kinds import MOTION, RESTS, AcrossKinds
from jointscope.graphs.joint_kinds.discover_arm import ArmDiscovery
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.terminal.diagnosis_text import diagnosis_text
from jointscope.tools.terminal.searches import arm_discovery_text, rest_search_text
from jointscope.tools.terminal.text_table import text_table

SHOWN = 10
WORDS = {MOTION: "motion", POSES: "poses", FREQUENCY: "responses", RESTS: "rests"}
HEAD = ["effect", "verdict", "shown by", "cannot be shown by", "speaks against it", "size", "look-alikes"]


def kinds_text(found: KindsDiagnosis, arm: ArmDiscovery | None = None) -> str:
    """The ranking over all kinds first, then what each kind says.

    Args:
        found: the diagnosis.
        arm: its poses and frequency responses with their errors on those held out; None without.
    """
    parts = [
        "\n".join([kinds_headline(found), *(f"  - {sentence}" for sentence in kinds_sentences(found))]),
        text_table(HEAD, kinds_rows(found), "<" * len(HEAD)),
    ]
    if found.arm_base is not None:
        parts[1:1] = arm_discovery_text.moved_sentences(found.arm_base)
    if found.motion is not None:
        parts.append(f"Motion alone:\n{diagnosis_text(found.motion)}")
    if found.arm:
        kinds = _kinds(found.arm_kinds)
        ranking = arm_discovery_text.ranking_text(found.arm, f"{kinds} alone", found.arm_kinds)
        parts.append(f"{kinds[0].upper()}{kinds[1:]} alone:\n{ranking}")
        parts += [] if arm is None else arm_discovery_text.heldout_table(arm)
    if found.rests is not None:
        parts.append(f"Rests alone:\n{rest_search_text.rest_search_text(found.rests)}")
    return "\n\n".join(parts)


def kinds_headline(found: KindsDiagnosis) -> str:
    """What is missing, and who shows it."""
    missing = [c for c in found.candidates if c.verdict == "missing"]
    told, said = set[str](), list[str]()
    for c in missing:
        if c.label not in told:
            alike = [other.label for other in missing if other.label in c.look_alikes]
            told |= {c.label, *alike}
            said.append(f"{' or '.join([c.label, *alike])}, shown by {_kinds(c.shown_by)}")
    if said:
        return f"Missing: {'; '.join(said[:3])}."
    if found.adequate:
        return f"Nothing of the catalogue is missing in {_kinds(found.kinds)}."
    return "The model lacks something, but no effect of the catalogue explains it in all kinds."


def kinds_sentences(found: KindsDiagnosis) -> list[str]:
    """Kinds that contradict each other, and those that tell look-alikes apart."""
    lines = []
    for c in found.candidates:
        if c.shown_by and c.against:
            others = [kind for kind in c.against if kind not in c.shown_by] or [*c.against]
            lines.append(
                f"{c.label} is shown by {_kinds(c.shown_by)}, but its size in {_kinds(others)} contradicts that"
            )
        if c.explained_by:
            other = next(o for o in found.candidates if o.label == c.explained_by)
            lines.append(
                f"{c.label} looks like {c.explained_by} in {_kinds(c.shown_by)}; {_kinds(other.shown_by)} could show "
                "both and shows the latter"
            )
        for kind, labels in c.told_apart.items() if c.verdict == "missing" else ():
            left = " or ".join([c.label, *c.look_alikes])
            lines.append(f"{' or '.join(labels)} would do the same in another kind; with {WORDS[kind]}: {left}")
    return lines


def kinds_rows(found: KindsDiagnosis) -> list[list[str]]:
    """A row of `HEAD` for each of the leading effects."""
    return [
        [
            c.label,
            c.verdict,
            _kinds(c.shown_by),
            _kinds([kind for kind, said in c.by_kind.items() if said.verdict == "untestable"]),
            _kinds(c.against),
            _sizes(c),
            ", ".join(c.look_alikes),
        ]
        for c in found.candidates[:SHOWN]
    ]


def _sizes(c: AcrossKinds) -> str:
    """Of the kinds that show it, else of all that can."""
    kinds = c.shown_by or tuple(kind for kind, said in c.by_kind.items() if said.verdict != "untestable")
    each = []
    for kind in kinds:
        sizes = c.by_kind[kind].sizes.items()
        said = ", ".join(f"{n} {significant(v, 3)} +- {significant(s, 2)} {unit}" for n, (v, s, unit) in sizes)
        each.append(f"{WORDS[kind]}: {said}")
    return "; ".join(each)


def _kinds(kinds: tuple[str, ...] | list[str]) -> str:
    return " and ".join(WORDS[kind] for kind in kinds)
