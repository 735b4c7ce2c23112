# SPDX-License-Identifier: BSD-3-Clause
"""Physical effects in words: the list of all, and the card of one, for the terminal and for machines."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from typing import Any

from jointscope.robots.effect_kinds.effect import Effect, EffectParameter
from jointscope.robots.effect_kinds.groups import GROUPS, group_of
from jointscope.tools.terminal.text_table import text_table

WIDTH = 100
LONGEST = 30  # characters of null values in the list
LABEL = 14
OWNERS = 27  # columns of the list
SIGNS = {"+": "never negative", "+-": "either sign"}


def list_text(effects: Iterable[Effect]) -> str:
    """One line per effect, under the part of the robot where it sits."""
    rows, groups = [], []
    for effect in effects:
        first, *more = textwrap.wrap(", ".join(effect.owners), OWNERS)
        rows += [[effect.id, first, effect.card.title, _nulls(effect)], *(["", owners, "", ""] for owners in more)]
        groups += [group_of(effect)] * (1 + len(more))
    head, *lines = text_table(["effect", "owner", "what it is", "absent at"], rows, "<<<<").splitlines()
    text = [head]
    for group in GROUPS:
        own = [line.rstrip() for line, its in zip(lines, groups, strict=True) if its == group]
        if own:
            text += ["", group, *own]
    return "\n".join([*text, "", "`jointscope effects ID` prints the card of one."])


def card_text(effect: Effect) -> str:
    """Everything a user should know about an effect before it goes into a model."""
    card = effect.card
    heading = f"{effect.id}: {card.title}"
    lines = [heading, "=" * len(heading), "", *textwrap.wrap(card.explanation, WIDTH, break_on_hyphens=False), ""]
    lines += _entry("law", card.law)
    lines += _entry("owner", ", ".join(effect.owners) + (" (the last one)" if getattr(effect, "last_only", 0) else ""))
    lines += _entry("typical size", card.typical)
    lines += _entry("excitation", card.excitation)
    lines += _entry("source", card.source)
    if card.numerics:
        lines += _entry("note", "a defect of the computation, not physics")
    lines += ["", *_parameters(effect)]
    if card.look_alikes:
        lines += ["", "hard to tell from"]
        for other, reason in card.look_alikes.items():
            text = f"{other}: {reason}"
            lines += textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="    ", break_on_hyphens=False)
    return "\n".join(lines)


def effect_json(effect: Effect) -> dict[str, Any]:
    """The card for machines."""
    card = effect.card
    return {
        **{"id": effect.id, "title": card.title, "group": group_of(effect), "owners": list(effect.owners)},
        **{"law": card.law, "explanation": card.explanation, "source": card.source, "typical": card.typical},
        **{"excitation": card.excitation, "look_alikes": dict(card.look_alikes), "numerics": card.numerics},
        "parameters": {
            p.name: {
                **{"unit": p.unit, "null": None if p.is_shape else p.null, "sign": p.sign, "start": p.start},
                **{"prior_sigma": p.prior_sigma, "logarithmic": p.logarithmic, "grid": list(p.grid), "weak": p.weak},
            }
            for p in effect.parameters
        },
    }


def _parameters(effect: Effect) -> list[str]:
    if not effect.parameters:
        return ["no parameters"]
    rows = [[p.name, p.unit, null_text(p), SIGNS[p.sign], f"{p.start:.3g}", remark_text(p)] for p in effect.parameters]
    head = ["parameter", "unit", "null value", "sign", "start", ""]
    return text_table(head, rows, "<<<<><", 0).splitlines()


def _nulls(effect: Effect) -> str:
    """At which values the effect is not there; a_x 0 and a_y 0 as a_x/y 0."""
    found: dict[tuple[str, float], list[str]] = {}
    for p in effect.parameters:
        if not p.is_shape:
            stem, _, end = p.name.rpartition("_")
            found.setdefault((f"{stem}_" if stem else p.name, p.null), []).append(end if stem else "")
    text = ", ".join(f"{stem}{'/'.join(ends)} {null:g}" for (stem, null), ends in found.items())
    nulls = {null for _, null in found}
    return (
        f"all {sum(map(len, found.values()))} sizes {nulls.pop():g}"
        if len(text) > LONGEST and len(nulls) == 1
        else text
    )


def null_text(p: EffectParameter) -> str:
    """At which value the effect is absent; a shape has none."""
    return "none" if p.is_shape else f"{p.null:g}"


def remark_text(p: EffectParameter) -> str:
    """What else is to be said about a parameter."""
    remarks = ["a shape"] if p.is_shape else []
    if p.of_range:
        shares = ", ".join(f"{share:g}" for share in p.grid)
        remarks.append(f"tried at {shares} of the range seen")
    elif len(p.grid) > 1:
        remarks.append(f"a diagnosis tries {len(p.grid)} values, {p.grid[0]:g} to {p.grid[-1]:g}")
    if p.held:
        remarks.append("held")
    if p.weak:
        remarks.append("often weak" if len(p.grid) > 1 else "often weak, held by its prior")
    return "; ".join(remarks)


def _entry(label: str, text: str) -> list[str]:
    indent = " " * LABEL
    return textwrap.wrap(f"{label:<{LABEL}}{text}", WIDTH, subsequent_indent=indent, break_on_hyphens=False)
