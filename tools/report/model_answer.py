# SPDX-License-Identifier: BSD-3-Clause
"""Is the model adequate? One plain sentence for a diagnosis and for a discovery, with the numbers behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from jointscope.graphs.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery_result import Discovery, DiscoveryStep
from jointscope.tools.report.numbers import percent, significant


@dataclass(frozen=True)
class Answer:
    """Level (good, warn or bad), the sentence, and the numbers that it rests on, as another sentence."""

    level: str
    headline: str
    why: str


def diagnosis_answer(result: Diagnosis) -> Answer:
    """What a diagnosis says about its base model."""
    where = "on the held-out recording" if result.heldout is not None else "on blocks that were left out"
    why = (
        f"0.1 s ahead {where} the error is {significant(result.error)} sensor sigmas, noise alone would give "
        f"{significant(result.floor)}; {percent(max(result.unexplained_share, 0.0))} of the squared error is "
        "unexplained."
    )
    missing, possible = of_verdict(result, "missing"), of_verdict(result, "possible")
    if result.adequate:
        return Answer("good", "The model is adequate: no physical effect is missing.", why)
    if len(missing) == 1:
        return Answer("bad", f"The model is not adequate: it lacks {missing[0].label}.", why)
    if missing:
        return Answer("bad", f"The model is not adequate: it lacks {enumerated([c.label for c in missing])}.", why)
    if possible:
        labels = enumerated([c.label for c in possible[:3]], "or")
        return Answer("warn", f"The model is not adequate; it may lack {labels}, but no effect is certain.", why)
    return Answer("bad", "The model is not adequate, and no known effect explains what is missing.", why)


def discovery_answer(result: Discovery) -> Answer:
    """What a discovery says about its last model."""
    first, last = result.steps[0], result.steps[-1]
    where = "on the held-out recording" if result.held_out else "on blocks that were left out"
    floor = f"noise alone would give {significant(last.floor)}"
    if len(result.steps) == 1:
        why = f"The error {where} is {significant(judged_error(first))} sensor sigmas; {floor}."
    else:
        why = (
            f"The error {where} went from {significant(judged_error(first))} to {significant(judged_error(last))} "
            f"sensor sigmas; {floor}."
        )
    effects = enumerated(changes(result))
    if result.adequate:
        text = f"The model is adequate with {effects}." if effects else "The model is adequate as it was."
        return Answer("good", text, why)
    if effects:
        return Answer("warn", f"The model is better with {effects}, but still not adequate.", why)
    return Answer("bad", "The model is not adequate, and no known effect makes it better.", why)


def changes(result: Discovery) -> list[str]:
    """Effects that were added and are still there, then what was removed from the base model."""
    added: list[str] = []
    removed: list[str] = []
    for step in result.steps:
        if step.removed in added:
            added.remove(step.removed)
        elif step.removed:
            removed.append(f"without {step.removed}")
        if step.added:
            added.append(step.added)
    return added + removed


def judged_error(step: DiscoveryStep) -> float:
    """The error on the held-out recording where there is one, else on blocks that were left out."""
    return step.heldout_error if math.isfinite(step.heldout_error) else step.train_error


def unexplained_share(step: DiscoveryStep) -> float:
    """Share of the squared error above the floor, 0 to 1."""
    error = judged_error(step)
    return max(0.0, 1.0 - (step.floor / error) ** 2) if error > 0.0 else 0.0


def of_verdict(result: Diagnosis, verdict: str) -> list[Candidate]:
    """Physical candidates of one verdict, best first."""
    return [c for c in result.candidates if c.verdict == verdict and not c.numerics]


def enumerated(names: Sequence[str], word: str = "and") -> str:
    """A, B and C."""
    return f" {word} ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
