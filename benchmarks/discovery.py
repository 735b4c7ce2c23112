# SPDX-License-Identifier: BSD-3-Clause
"""The table of hidden effects and what was promised about them, from the rows that have been measured."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from discovery_row import Row
from hidden_effects import KINDS, TEST, TRAIN
from tables import Section, Table

FIRST = 0.95  # of the recordings whose effect matters
PAIRS_FOUND = 0.8
NAMED = 10.0 / 12.0
SPRINGS = 0.9
NAMED_AXES, FALSE = 0.9, 0.05
RIPPLE = "cogging@axis"  # every such axis but the quiet ones has a small one
HALF = 0.5  # of the squared error above the floor
LARGEST_Z = 3.0
DIAGNOSE, SCORE = 60.0, 10.0  # [s] on 20 s of recording
SCORE_STAGE = "score"  # in names of stages
CALIBRATION_STAGE = "calibrat"  # not part of a diagnosis

TITLES = {
    "effect": "One effect of the catalogue is hidden",
    "clean": "Nothing is hidden",
    "pair": "Two effects are hidden",
    "outside": "An effect outside the catalogue is hidden",
    "hard": "Short (6 s), disturbed (0.3 N m for 20 ms) and jittery (0.2 ms, 2 % lost) recordings",
    "mistake": "A setting is wrong",
    "setting": "A setting of an arm of a maker is wrong, or none: rigid, fine encoders, torques with a memory, ripple",
    "axis": "One large thing is missing in a slide or joint, or nothing, among small ones, from what `init` writes",
    "spring": "A spring of 6 to 40 Hz behind a slide or joint that is declared rigid, or none, from what `init` writes",
}
HEAD = (
    "hidden",
    "rank",
    "look-alike",
    "accepted",
    "base",
    "final",
    "true structure",
    "floor",
    "largest z",
    "adequate",
    "s",
)


def section(rows: Sequence[Row]) -> Section:
    """Targets and tables."""
    found = Section(
        "Discovery",
        f"{len(rows)} simulated Doggys, friction smooth, {TRAIN:g} s of calibration motion to learn from and {TEST:g} "
        "s of other moves held out, each with a seed of its own; arms of makers and single axes have their own. Errors "
        "are those of predictions 0.1 s ahead on the held-out recording in sensor sigmas; rank is that of the truth in "
        "the first diagnosis.",
    )
    _promise_ranks(found, rows)
    _promise_honesty(found, rows)
    _promise_models(found, rows)
    _promise_times(found, rows)
    for kind in KINDS:
        of_kind = [row for row in rows if row.kind == kind]
        if of_kind:
            found.tables.append(Table(TITLES[kind], HEAD, [cells(row) for row in of_kind]))
    found.notes += [f"{row.name}: ended with: {row.error}" for row in rows if row.error]
    found.notes += [f"{row.name}: {text}" for row in rows if row.kind == "mistake" for text in row.suspicions]
    found.numbers["rows"] = [row.to_json() for row in rows]
    return found


def kind_section(kind: str, rows: Sequence[Row]) -> Section:
    """Targets and table of one kind alone."""
    found = Section(
        f"Discovery: {kind}",
        f"{len(rows)} cases. Errors are those of predictions 0.1 s ahead on the held-out recording in sensor sigmas; "
        "rank is that of the truth in the first diagnosis.",
    )
    _promise_ranks(found, rows)
    _promise_honesty(found, rows)
    _promise_models(found, rows)
    found.tables.append(Table(TITLES[kind], HEAD, [cells(row) for row in rows]))
    found.notes += [f"{row.name}: ended with: {row.error}" for row in rows if row.error]
    found.numbers["rows"] = [row.to_json() for row in rows]
    return found


def cells(row: Row) -> tuple[str, ...]:
    """One line of the table."""
    hidden = row.name.rsplit(" (seed", 1)[0]
    if row.error:
        return (hidden, *[""] * (len(HEAD) - 3), "error", f"{row.seconds:.0f}")
    ranks = ", ".join(str(rank) if rank else "not a candidate" for rank in row.ranks)
    z = f"{max(row.z.values(), key=abs):+.1f}" if row.z else ""
    errors = [_number(e) for e in (row.base_error, row.final_error, row.true_error, row.floor)]
    adequate = "yes" if row.adequate else "no"
    alike = row.first if row.look_alike and row.first not in row.truth else ""
    return (hidden, ranks, alike, ", ".join(row.accepted) or "none", *errors, z, adequate, f"{row.seconds:.0f}")


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _promise_ranks(found: Section, rows: Sequence[Row]) -> None:
    """The truth comes first where it matters; pairs are both found."""
    telling = [row for row in rows if row.kind in ("effect", "hard") and row.truth and (row.matters or row.error)]
    _count(found, "truth or its look-alike first, where it matters by 10 %", FIRST, [r.found_first for r in telling])
    singles = [row for row in telling if row.kind == "effect"]
    if singles:
        found.promise("&nbsp;&nbsp;truth itself first", "", _share([row.first in row.truth for row in singles]))
    pairs = [row for row in rows if row.kind == "pair"]
    _count(found, "pairs: both accepted", PAIRS_FOUND, [set(row.truth) <= set(row.accepted) for row in pairs])


def _promise_honesty(found: Section, rows: Sequence[Row]) -> None:
    """Nothing is found where nothing is, and nothing is called adequate where something is left."""
    for kind, where in (("clean", ""), ("hard", ", hard recordings")):
        rows_without = [row for row in rows if row.kind == kind and not row.truth]
        nothing = [not row.physics and not row.error for row in rows_without]
        _count(found, f"nothing hidden{where}: no physical effect accepted", 1.0, nothing)
        _count(found, f"nothing hidden{where}: called adequate", 1.0, [bool(row.adequate) for row in rows_without])
    outside = [row for row in rows if row.kind == "outside"]
    _count(found, "outside the catalogue: not called adequate", 1.0, [not row.adequate for row in outside])
    explained = [row.explained < HALF for row in outside if row.accepted and row.explained is not None]
    _count(found, "outside the catalogue: what is accepted explains less than half of the excess", 1.0, explained)
    mistakes = [row for row in rows if row.kind == "mistake"]
    _count(found, "wrong setting: named as what it is", 1.0, [row.named for row in mistakes])
    arms = [row for row in rows if row.kind == "setting"]
    named = [row.first in row.truth for row in arms if row.truth]
    _count(found, "arms with a wrong setting: named first", NAMED, named)
    nothing = [not row.physics and not row.error for row in arms if not row.truth]
    _count(found, "arms with nothing wrong: nothing accepted", 1.0, nothing)
    axes = [row for row in rows if row.kind == "spring"]
    named = [row.first in row.truth for row in axes if row.truth]
    _count(found, "axes with an undeclared spring: named first", SPRINGS, named)
    sized = [bool(row.z) and max(map(abs, row.z.values())) <= LARGEST_Z for row in axes if row.truth]
    _count(found, "axes with an undeclared spring: in the model, within 3 sigma", SPRINGS, sized)
    rigid = [not row.physics and not row.error for row in axes if not row.truth]
    _count(found, "axes without one: nothing accepted", 1.0, rigid)
    _promise_axes(found, [row for row in rows if row.kind == "axis"])
    _count(found, "wrong setting: never called friction or Coriolis", 1.0, [not row.blamed for row in mistakes])
    elsewhere = [not row.adequate or row.named for row in mistakes]
    _count(found, "wrong setting: not called adequate unless it was named", 1.0, elsewhere)


def _promise_axes(found: Section, axes: Sequence[Row]) -> None:
    """The one large thing comes first and in, and nothing comes in that is not there; ripples are."""
    told = [row for row in axes if row.truth]
    _count(
        found, "axes that lack one large thing: it or its look-alike first", NAMED_AXES, [r.found_first for r in told]
    )
    extra = [set(row.physics) - set(row.truth) - {RIPPLE} for row in axes]
    allowed = [{row.first} if row.truth and row.found_first else set() for row in axes]
    none = [not row.error and not more - own for row, more, own in zip(axes, extra, allowed, strict=True)]
    _count(found, "axes: nothing in the model that is not there", 1.0 - FALSE, none)


def _promise_models(found: Section, rows: Sequence[Row]) -> None:
    """The last model is as good as one of the true structure, its parameters are near the truth."""
    judged = [row.as_good for row in rows if row.as_good is not None]
    _count(found, "final error at most 1.1 times that of the true structure", 1.0, judged)
    z = [abs(value) for row in rows for value in row.z.values()]
    _count(found, "parameters of true effects within 3 sigma", 1.0, [value <= LARGEST_Z for value in z])


def _promise_times(found: Section, rows: Sequence[Row]) -> None:
    """Seconds of the first diagnosis, without the calibration of the base model.

    The median counts: other work on the machine lengthens single ones. Time a quiet machine with `--jobs 1`.
    """
    stages = [
        row.stages
        for row in rows
        if row.stages and row.kind not in ("setting", "spring", "axis") and "short" not in row.name
    ]
    if not stages:
        return
    whole = [sum(s for name, s in stage.items() if CALIBRATION_STAGE not in name) for stage in stages]
    score = [sum(s for name, s in stage.items() if SCORE_STAGE in name) for stage in stages]
    for what, seconds, limit in ((f"diagnosis of {TRAIN:g} s", whole, DIAGNOSE), ("its score step", score, SCORE)):
        middle = median(seconds)
        measured = f"{middle:.1f} s, slowest {max(seconds):.1f} s"
        found.promise(f"{what}: median", f"below {limit:g} s", measured, middle < limit)


def _count(found: Section, what: str, share: float, kept: Sequence[bool]) -> None:
    """A promise about a share of the recordings; without recordings there is nothing to promise."""
    if kept:
        target = "all" if share == 1.0 else f"at least {100 * share:.0f} %"
        found.promise(what, target, _share(kept), sum(kept) >= share * len(kept))


def _share(kept: Sequence[bool]) -> str:
    return f"{sum(kept)} of {len(kept)}" if kept else "none"
