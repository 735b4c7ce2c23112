# SPDX-License-Identifier: BSD-3-Clause
"""What recordings of several kinds say together of each effect: who shows it, who cannot, and who speaks against it.

Each kind (poses and frequency responses share a graph) is calibrated and judged by its own left-out recordings: held to
the values of a kind that shows an effect, a model that lacks it would show others in the next kind.

- Steps from a model of which responses say that one is missing lead anywhere: their sizes speak against nothing.
- An effect is missing where a kind shows it and no kind has a size for it that contradicts (sizes are linear steps, or
  fits of one kind). One that a kind leaves possible is absent where another kind has a size that contradicts.
- Look-alikes of one kind stay alike only where every kind that shows the effect has them. Where a kind shows one of two
  look-alikes of another kind, and could show both, that one explains what the other kind sees.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, log

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery.verdicts import HORIZON
from jointscope.graphs.joint_kinds.effect_judge import ArmCandidate
from jointscope.graphs.rest_search.rest_judge import RestCandidate
from jointscope.robots.geometry.arm_effects import KINDS
from jointscope.robots.geometry.error_parameters import STIFFNESS

MOTION, RESTS = "motion", "rests"
APART, SHARE = 3.0, 0.5  # [sigma], share of the larger one: from both on sizes in two kinds contradict each other
LEAST_LEFT = 1e-6  # share of squares, of which a smaller one would say no more
ORDER = ("missing", "possible", "absent", "untestable")
Size = tuple[float, float, str]
"""Value, sigma, unit."""


@dataclass(frozen=True)
class Said:
    """What a kind of recordings says of an effect.

    Attributes:
        verdict: missing, possible, absent, untestable, or stand_in.
        sizes: of its parameters, by the last part of their names.
        look_alikes: labels of effects that do the same in this kind.
        why: why it is untestable.
        evidence: twice the logarithm of how much likelier what was left out becomes; 0 where that is not known.
        sure: whether its sizes may speak against others: steps from a model that explains little lead anywhere.
    """

    verdict: str
    sizes: Mapping[str, Size]
    look_alikes: tuple[str, ...] = ()
    why: str = ""
    evidence: float = 0.0
    sure: bool = True


@dataclass(frozen=True)
class AcrossKinds:
    """An effect in all kinds.

    Attributes:
        label: ID@OWNER.
        by_kind: what each kind says that knows the effect.
        against: kinds whose size of it contradicts that of one that shows it, which may show it, too; of an effect that
            is possible, that of one that has it so.
        explained_by: label of a look-alike in the kinds that show it, which another kind shows instead; "" without.
    """

    label: str
    by_kind: Mapping[str, Said]
    against: tuple[str, ...]
    explained_by: str = ""

    @property
    def shown_by(self) -> tuple[str, ...]:
        """Kinds in which it is missing."""
        return tuple(kind for kind, said in self.by_kind.items() if said.verdict == "missing")

    @property
    def evidence(self) -> float:
        """Of all kinds that show it: twice the logarithm of how much likelier left-out recordings become."""
        return sum(self.by_kind[kind].evidence for kind in self.shown_by)

    @property
    def seen_by(self) -> tuple[str, ...]:
        """Kinds in which it does anything."""
        return tuple(kind for kind, said in self.by_kind.items() if said.verdict != "untestable")

    @property
    def verdict(self) -> str:
        """Of all kinds together."""
        verdicts = {said.verdict for said in self.by_kind.values()}
        if self.shown_by:
            return "possible" if self.against or self.explained_by else "missing"
        if verdicts & {"possible", "stand_in"}:
            return "absent" if self.against else "possible"
        return "absent" if "absent" in verdicts else "untestable"

    @property
    def look_alikes(self) -> tuple[str, ...]:
        """Effects that do the same in every kind that shows this one; in every kind where none does."""
        kinds = self.shown_by or tuple(k for k, said in self.by_kind.items() if said.verdict != "untestable")
        each = [self.by_kind[kind].look_alikes for kind in kinds]
        return tuple(label for label in each[0] if all(label in other for other in each[1:])) if each else ()

    @property
    def told_apart(self) -> Mapping[str, tuple[str, ...]]:
        """By the kind that tells them apart: effects that are look-alikes in another kind that shows this one."""
        found: dict[str, tuple[str, ...]] = {}
        for kind in self.shown_by:
            others = [label for k in self.shown_by if k != kind for label in self.by_kind[k].look_alikes]
            own = tuple(dict.fromkeys(label for label in others if label not in self.by_kind[kind].look_alikes))
            found |= {kind: own} if own else {}
        return found


def across_kinds(kinds: Mapping[str, Mapping[str, Said]]) -> tuple[AcrossKinds, ...]:
    """All effects, best first: those that more kinds show, then those that come earlier in the ranking of one.

    Args:
        kinds: what each kind says, by label, best first.
    """
    ranks: dict[str, int] = {}
    for each in kinds.values():
        for rank, label in enumerate(each):
            ranks[label] = min(rank, ranks.get(label, rank))
    found = {}
    for label in ranks:
        by_kind = {kind: each[label] for kind, each in kinds.items() if label in each}
        shown = [said for said in by_kind.values() if said.verdict == "missing"]
        shown = shown or [said for said in by_kind.values() if said.verdict in ("possible", "stand_in")]
        shown = [said for said in shown if said.sure] or shown
        seen = ((kind, said) for kind, said in by_kind.items() if said.verdict != "untestable" and said.sure)
        against = tuple(kind for kind, said in seen if any(_contradicts(said, other) for other in shown))
        found[label] = AcrossKinds(label, by_kind, against)
    told = [replace(c, explained_by=_explaining(c, found)) for c in found.values()]
    return tuple(sorted(told, key=lambda c: (ORDER.index(c.verdict), -len(c.shown_by), ranks[c.label])))


def _explaining(c: AcrossKinds, found: Mapping[str, AcrossKinds]) -> str:
    """Label of the look-alike that another kind shows in place of an effect, though it could show both; "" without."""
    for label in c.look_alikes if c.shown_by else ():
        other = found.get(label)
        if other is None or other.against:
            continue
        if other.evidence < c.evidence and _shown_instead(c, other):
            continue  # each is shown where the other could be: more evidence is better
        if _shown_instead(other, c):
            return label
    return ""


def _shown_instead(one: AcrossKinds, other: AcrossKinds) -> bool:
    """Whether a kind whose sizes can be trusted shows one of two effects and not the other, though it could."""
    kinds = (kind for kind in one.shown_by if one.by_kind[kind].sure)
    known = ((kind, other.by_kind.get(kind)) for kind in kinds if kind not in other.shown_by)
    return any(said is not None and said.verdict != "untestable" for _, said in known)


def _contradicts(one: Said, other: Said) -> bool:
    """Whether two kinds have sizes of an effect that cannot be the same."""
    pairs = [(size, other.sizes[name]) for name, size in one.sizes.items() if name in other.sizes]
    same = ((a, b) for a, b in pairs if a[2] == b[2])
    return any(
        (a[0] - b[0]) ** 2 > APART**2 * (a[1] ** 2 + b[1] ** 2) and abs(a[0] - b[0]) > SHARE * max(abs(a[0]), abs(b[0]))
        for a, b in same
    )


def said_by_motion(found: Diagnosis) -> dict[str, Said]:
    """What recordings of motion say, by label."""
    seconds = sum(recording.duration for recording in found.recordings)
    return {
        c.label: Said(
            c.verdict,
            {name: (p.value, p.sigma, p.unit) for name, p in c.parameters.items()},
            c.look_alikes,
            " ".join(c.reasons) if c.verdict == "untestable" else "",
            _evidence_of_motion(c, seconds),
        )
        for c in found.candidates
        if not c.numerics
    }


def _evidence_of_motion(c: Candidate, seconds: float) -> float:
    """By the errors of predictions that do not overlap, or by as many torques where these are judged."""
    if isfinite(c.bic):
        return -c.bic
    return -seconds / HORIZON * log(max(1.0 - c.share, LEAST_LEFT)) if isfinite(c.share) else 0.0


def said_by_rests(candidates: Iterable[RestCandidate]) -> dict[str, Said]:
    """What rests say, by label."""
    return {c.label: Said(c.verdict, c.sizes, c.look_alikes, c.why, 2.0 * c.gain) for c in candidates}


def said_by_arm(
    candidates: Sequence[ArmCandidate], kinds: Sequence[str], sure: bool = True
) -> dict[str, dict[str, Said]]:
    """What poses and frequency responses say, by kind and label.

    Args:
        candidates: judged by both in one graph, which has one size for both.
        kinds: of the recordings that there are.
        sure: whether the model without any of them explains the responses.
    """
    found: dict[str, dict[str, Said]] = {kind: {} for kind in kinds}
    for c in candidates:
        unit = "rad/(N m)" if c.hypothesis.kind.soft else c.hypothesis.kind.unit
        pairs = zip(c.hypothesis.catalogue_names, c.sizes, c.sigmas, strict=True)
        soft, factor = c.hypothesis.kind.soft, c.hypothesis.kind.catalogue[1]
        sizes = {_last_part(name, soft): (factor * value, sigma, unit) for name, value, sigma in pairs}
        evidence = c.evidence  # of both kinds together: it counts once
        for kind in kinds:
            unseen = c.hypothesis.kind.unseen.get(kind, "")
            verdict = "untestable" if unseen else c.verdict
            if verdict == "missing" and len(kinds) > 1 and kind not in c.shown_by:
                verdict = "possible"
            alike = c.alone.get(kind, c.look_alikes)
            found[kind][c.hypothesis.label] = Said(verdict, sizes, alike, unseen, evidence, sure)
            evidence = 0.0 if verdict == "missing" else evidence
    return found


def unseen_by_arm(labels: Iterable[str], kinds: Sequence[str]) -> dict[str, dict[str, Said]]:
    """Effects that other kinds know, and that do nothing in poses or in frequency responses, by kind and label.

    Args:
        labels: of the effects.
        kinds: of the recordings that there are.
    """
    unseen, found = {kind.id: kind.unseen for kind in KINDS}, dict[str, dict[str, Said]]()
    for label in labels:
        for kind in kinds:
            why = unseen.get(label.partition("@")[0], {}).get(kind)
            if why is not None:
                found.setdefault(kind, {})[label] = Said("untestable", {}, (), why)
    return found


def _last_part(name: str, soft: bool) -> str:
    """Of the name of a parameter; stiffnesses that are looked for have the sizes of their compliances."""
    last = name.rpartition(".")[2]
    return last.replace(STIFFNESS, "compliance") if soft else last
