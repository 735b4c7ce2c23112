# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis in plain words: what fails, what explains it and how well, what cannot be told apart or tested."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.graphs.discovery.verdicts import SAME
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.robot import Robot

MOST_UNTESTABLE = 5


def paragraphs_of(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Paragraphs, most important first."""
    found = [_verdict(diagnosis)]
    if diagnosis.failure.sentences and not diagnosis.adequate:
        found.append(". ".join(sentence.rstrip(".") for sentence in diagnosis.failure.sentences[:3]) + ".")
    missing = [c for c in diagnosis.candidates if c.verdict == "missing"]
    found += [_explains(c, diagnosis) for c in missing[:3]]
    found += [_stands_in(c) for c in diagnosis.candidates if c.verdict == "stand_in" and c.refitted][:1]
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
    part = part_in_words(d.unexplained_share)
    if d.missing_torque_percent is not None:
        return (
            "Nothing in the catalogue explains what is missing: smooth laws of position and speed would explain "
            f"{part} of the squared missing torque."
        )
    return (
        f"Nothing in the catalogue explains what is missing: {part} of the squared error ({d.error:.3g} sigma against "
        f"a floor of {d.floor:.3g}) stays unexplained."
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


def _stands_in(c: Candidate) -> str:
    return f"{title(c)} stands in for something else: {', '.join(c.reasons)}."


def _untestable(candidates: list[Candidate]) -> str:
    labels = ", ".join(c.label for c in candidates[:MOST_UNTESTABLE])
    rest = len(candidates) - MOST_UNTESTABLE
    more = f" and {rest} more" if rest > 0 else ""
    return f"Not testable with this motion, which is not the same as absent: {labels}{more}."


def title(c: Candidate) -> str:
    """The effect's name with its owner."""
    effect = catalogue().get(c.effect)
    return f"{effect.card.title if effect else c.effect} ({c.label})"


def did_not_hold(refused: Mapping[str, str]) -> str:
    """Why a search stopped whose candidates did not hold: the reasons by their labels."""
    why = "; ".join(f"{label} {reason}" for label, reason in refused.items())
    return f"what helped on validation blocks did not hold when calibrated with all data: {why}"


def why_it_stopped(diagnosis: Diagnosis) -> str:
    """Why a search stopped with the last diagnosis."""
    if diagnosis.missing_torque_percent is not None:
        joint, percent = max(diagnosis.missing_torque_percent.items(), key=lambda item: item[1])
        lacks = f"{percent:.2g} % of the drive's torque is missing at {joint}"
        if diagnosis.adequate:
            return f"the model is adequate: no more than {lacks}, of which no effect and no smooth law explain more"
        part = part_in_words(diagnosis.unexplained_share)
        return f"nothing in the catalogue explains the rest: {lacks}, of whose square smooth laws would explain {part}"
    if diagnosis.adequate:
        return "the model is adequate: no effect of the catalogue is missing, and the error is at its floor"
    part = part_in_words(diagnosis.unexplained_share)
    return f"nothing in the catalogue explains the rest: {part} of the squared error above what noise alone would leave"


def what_came_in(candidate: Candidate, robot: Robot, before: float, after: float) -> str:
    """What an effect that was added is and does; training errors before and after."""
    start = f"{candidate.owner}.{candidate.effect}."
    own = [(name[len(start) :], p) for name, p in robot.parameters.items() if name.startswith(start)]
    values = ", ".join(f"{name} {p.value:.4g} {p.unit}".removesuffix(" 1") for name, p in own)
    what = f"{candidate.label} added ({values})" if values else f"{candidate.label} taken care of"
    why = "" if candidate.refitted or not candidate.reasons else f" It {candidate.reasons[0].removeprefix('it ')}."
    if after < before:
        return f"{what}: the training error falls from {before:.3g} to {after:.3g} sigma.{why}"
    return (
        f"{what}: less torque is missing on blocks left out, although the training error rises from {before:.3g} to "
        f"{after:.3g} sigma: something else is missing, too.{why}"
    )


def rises_elsewhere(before: float, after: float) -> str:
    """What is said of an effect with which the error on the held-out recording, which never chooses, is larger."""
    if not after > (1.0 + SAME) * before:
        return ""
    return (
        f" On the held-out recording the error rises from {before:.3g} to {after:.3g} sigma: it may fit what is "
        "peculiar to the training recordings."
    )
