# SPDX-License-Identifier: BSD-3-Clause
"""What the catalogue says about an effect; nothing for one that it does not know."""

from __future__ import annotations

from collections.abc import Mapping

from jointscope.robots.effect_kinds.effect import Card


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
