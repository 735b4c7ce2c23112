# SPDX-License-Identifier: BSD-3-Clause
"""Is the model adequate? One plain sentence for a diagnosis and for a discovery, with the numbers behind it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery, DiscoveryStep
from jointscope.robots.effect_kinds.effect import Card
from jointscope.tools.presentation.numbers import percent, significant

BELIEVED = 0.9  # share of the excess that effects have to explain together where the model stays inadequate


@dataclass(frozen=True)
class Answer:
    """Level (good, warn or bad), the sentence, and the numbers that it rests on, as another sentence."""

    level: str
    headline: str
    why: str


def diagnosis_answer(result: Diagnosis) -> Answer:
    """What a diagnosis says about its base model."""
    fitted = "" if result.heldout is not None else ", which the model was fitted to,"
    why = (
        f"The error {result.judged_by} on the {judged_recording(result)}{fitted} is {significant(result.error)} sensor "
        f"sigmas, noise alone would give {significant(result.floor)}; {percent(base_unexplained_share(result))} of the "
        "squared error is unexplained."
    )
    missing, possible = of_verdict(result, "missing"), of_verdict(result, "possible")
    defects = missing_numerics(result)
    if result.adequate:
        return Answer("good", "The model is adequate: no physical effect is missing.", why)
    if len(missing) == 1:
        return Answer("bad", f"The model is not adequate: it lacks {missing[0].label}.", why)
    if missing:
        return Answer("bad", f"The model is not adequate: it lacks {enumerated([c.label for c in missing])}.", why)
    if defects:
        labels = enumerated([c.label for c in defects])
        return Answer("bad", f"The model is not adequate: its computation is too coarse ({labels}).", why)
    if possible:
        labels = enumerated([c.label for c in possible[:3]], "or")
        return Answer("warn", f"The model is not adequate; it may lack {labels}, but no effect is certain.", why)
    return Answer("bad", "The model is not adequate, and no known effect explains what is missing.", why)


def discovery_answer(result: Discovery) -> Answer:
    """What a discovery says about its last model."""
    first, last = result.steps[0], result.steps[-1]
    where = (
        "on the held-out recording" if result.held_out else "on the training recordings, which the model is fitted to,"
    )
    floor = f"noise alone would give {significant(last.floor)}"
    if len(result.steps) == 1:
        why = f"The error {where} is {significant(judged_error(first))} sensor sigmas; {floor}."
    else:
        why = (
            f"The error {where} went from {significant(judged_error(first))} to {significant(judged_error(last))} "
            f"sensor sigmas; {floor}."
        )
    added, gone = _added_and_gone(result)
    effects = " and ".join(
        [f"{word} {enumerated(names)}" for word, names in (("with", added), ("without", gone)) if names]
    )
    if result.adequate:
        return Answer("good", f"The model is adequate {effects or 'as it was'}.", why)
    if effects:
        return Answer("warn", f"The model is better {effects}, but still not adequate.", why + _stand_in(result))
    return Answer("bad", "The model is not adequate, and no known effect makes it better.", why)


def _stand_in(result: Discovery) -> str:
    """A warning where what was added explains only part of what the base model lacks."""
    first, last = result.steps[0], result.steps[-1]
    excess = judged_error(first) ** 2 - last.floor**2
    explained = (judged_error(first) ** 2 - judged_error(last) ** 2) / excess if excess > 0.0 else 0.0
    if explained >= BELIEVED:
        return ""
    return (
        f" What changed explains {percent(max(explained, 0.0))} of the squared error above that; where the rest has "
        "another cause, an effect may only stand in for it: do not take its size for physics yet."
    )


def changes(result: Discovery) -> list[str]:
    """Effects that were added and are still there, then what the last model is without."""
    added, gone = _added_and_gone(result)
    return added + [f"without {label}" for label in gone]


def _added_and_gone(result: Discovery) -> tuple[list[str], list[str]]:
    """Adding a defect of the computation means doing without it."""
    added: list[str] = []
    gone: list[str] = []
    for step in result.steps:
        if step.removed in added:
            added.remove(step.removed)
        elif step.removed:
            gone.append(step.removed)
        if step.added:
            (gone if is_numerics(step.added.split("@")[0]) else added).append(step.added)
    return added, gone


def judged_error(step: DiscoveryStep) -> float:
    """The error on the held-out recording where there is one, else on the training recordings."""
    return step.heldout_error if math.isfinite(step.heldout_error) else step.train_error


def unexplained_share(step: DiscoveryStep) -> float:
    """Share of the squared error above the floor, 0 to 1."""
    error = judged_error(step)
    return max(0.0, 1.0 - (step.floor / error) ** 2) if error > 0.0 else 0.0


def judged_recording(result: Diagnosis) -> str:
    """Where error and floor of a diagnosis's base model were found."""
    if result.heldout is not None:
        return "held-out recording"
    return "first training recording" if len(result.recordings) > 1 else "training recording"


def base_unexplained_share(result: Diagnosis) -> float:
    """Of the base model, like the error and the floor it stands beside; that of a diagnosis may be after a refit."""
    return max(0.0, 1.0 - (result.floor / result.error) ** 2) if result.error > 0.0 else 0.0


def of_verdict(result: Diagnosis, verdict: str) -> list[Candidate]:
    """Physical candidates of one verdict, best first."""
    return [c for c in result.candidates if c.verdict == verdict and not c.numerics]


def missing_numerics(result: Diagnosis) -> list[Candidate]:
    """Defects of the computation that were found, best first."""
    return [c for c in result.candidates if c.verdict == "missing" and c.numerics]


def enumerated(names: Sequence[str], word: str = "and") -> str:
    """A, B and C."""
    return f" {word} ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def excitation_of(effect: str) -> str:
    """Which motion shows an effect."""
    card = _card(effect)
    return card.excitation if card else ""


def look_alike_reasons(effect: str) -> Mapping[str, str]:
    """Effects that are hard to tell from this one, with the reason."""
    card = _card(effect)
    return card.look_alikes if card else {}


def is_numerics(effect: str) -> bool:
    """Whether it is a defect of the computation."""
    card = _card(effect)
    return card is not None and card.numerics


def _card(effect: str) -> Card | None:
    from jointscope.robots.files.effect_catalogue import catalogue  # reads every effect's file: only where it is needed

    known = catalogue().get(effect)
    return known.card if known else None
