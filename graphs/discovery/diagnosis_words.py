# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis in plain words: what fails, what explains it and how well, what cannot be told apart or tested."""

from __future__ import annotations

from math import isfinite

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.robots.files.effect_catalogue import catalogue

MOST_UNTESTABLE = 5


def paragraphs_of(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Paragraphs, most important first."""
    found = [_verdict(diagnosis)]
    if diagnosis.failure.sentences and not diagnosis.adequate:
        found.append(". ".join(sentence.rstrip(".") for sentence in diagnosis.failure.sentences[:3]) + ".")
    missing = [c for c in diagnosis.candidates if c.verdict == "missing"]
    found += [_explains(c, diagnosis) for c in missing[:3]]
    if diagnosis.small:
        found.append(there_but_small(diagnosis.small))
    untestable = [c for c in diagnosis.candidates if c.verdict == "untestable"]
    if untestable:
        found.append(_untestable(untestable))
    return tuple(found)


def part_in_words(share: float) -> str:
    """A share in percent; predictions that run away leave none that is a number."""
    return f"{100 * share:.0f} %" if isfinite(share) else "a part that cannot be told"


def there_but_small(small: tuple[str, ...]) -> str:
    """What is significant and changes little."""
    return f"There, but small, and not added: {'; '.join(small)}."


def _verdict(d: Diagnosis) -> str:
    missing = [c for c in d.candidates if c.verdict == "missing" and not c.numerics]
    if missing:
        return (
            f"The model lacks {title(missing[0])}: its error {d.judged_by} is {d.error:.3g} sigma where noise "
            f"and state uncertainty allow {d.floor:.3g}."
        )
    numerics = [c for c in d.candidates if c.verdict == "missing" and c.numerics]
    if numerics:
        return (
            f"Before any physics: {title(numerics[0])}. It spoils the error {d.judged_by} ({d.error:.3g} sigma) and "
            "hides what else may be missing; take the better integrator (`model: integrator: simpson`) and diagnose "
            "again."
        )
    if d.adequate:
        return (
            f"The model is adequate: its error {d.judged_by} is {d.error:.3g} sigma, noise and state uncertainty alone "
            f"leave {d.floor:.3g}, and no effect of the catalogue would lower that."
        )
    return (
        f"Nothing in the catalogue explains what is missing: {part_in_words(d.unexplained_share)} of the squared error "
        f"({d.error:.3g} sigma against a floor of {d.floor:.3g}) stays unexplained."
    )


def _explains(c: Candidate, d: Diagnosis) -> str:
    values = ", ".join(
        f"{name} {p.value:.4g} +- {p.sigma:.2g} {p.unit}".removesuffix(" 1") for name, p in c.parameters.items()
    )
    sizes = f": {values}" if values else ""
    if d.missing_torque_percent is not None and not c.refitted:
        text = f"{title(c)} explains {100 * c.share:.0f} % of the squared missing torque on blocks left out{sizes}."
    else:
        text = (
            f"{title(c)} explains {100 * c.share:.0f} % of the squared error above the floor on validation blocks "
            f"({d.validation_error:.3g} to {c.validation_error:.3g} sigma){sizes}."
        )
    if c.heldout_error == c.heldout_error:
        text += f" On the held-out recording the error goes from {d.error:.3g} to {c.heldout_error:.3g} sigma."
    if c.look_alikes:
        text += f" In this recording it cannot be told apart from {', '.join(c.look_alikes)}."
    return text


def _untestable(candidates: list[Candidate]) -> str:
    labels = ", ".join(c.label for c in candidates[:MOST_UNTESTABLE])
    rest = len(candidates) - MOST_UNTESTABLE
    more = f" and {rest} more" if rest > 0 else ""
    return f"Not testable with this motion, which is not the same as absent: {labels}{more}."


def title(c: Candidate) -> str:
    """The effect's name with its owner."""
    effect = catalogue().get(c.effect)
    return f"{effect.card.title if effect else c.effect} ({c.label})"
