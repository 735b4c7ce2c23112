# SPDX-License-Identifier: BSD-3-Clause
"""The catalogue of effects as a page of markdown, written from the cards."""

from __future__ import annotations

from collections.abc import Container, Iterable

from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.effect_kinds.groups import GROUPS, group_of
from jointscope.tools.terminal.effect_text import SIGNS, null_text, remark_text

LEAD = """# Catalogue of effects

What a model may lack, part by part. `diagnose` and `discover` try all of them at every joint and sensor.
`jointscope add ROBOT ID@OWNER -o OUT.yaml` puts one into a model; [an effect of your own](your_own_effect.md) takes one
file. At its null values an effect is exactly absent.

The drawings show the law of an effect, where it is a torque, and its signature: what a model without the effect leaves
in its residuals while a ready robot moves along sines. The upper curve of a signature is the speed of the joint; below
is what the equations of motion or the readings of the sensors lack, before other parameters take their part of it.

`jointscope effects --page docs/catalogue.md` writes this page and draws its pictures from the cards that
`jointscope effects ID` prints."""


def effect_page(effects: Iterable[Effect], drawn: Container[str] = (), folder: str = "") -> str:
    """The page: a list by part of the robot, then every card.

    Args:
        effects: in any order.
        drawn: names of the pictures that there are, ID.svg of laws and ID.signature.svg.
        folder: of the pictures, from the page on.
    """
    groups: dict[str, list[Effect]] = {group: [] for group in GROUPS}
    for effect in effects:
        groups[group_of(effect)].append(effect)
    parts = [LEAD]
    for group, members in groups.items():
        rows = (f"\n| [{e.id}](#{e.id}) | {', '.join(e.owners)} | {_cell(e.card.title)} |" for e in members)
        table = "| effect | acts on | what it is |\n| --- | --- | --- |" + "".join(rows)
        parts += [
            f"## {group[:1].upper()}{group[1:]}",
            table,
            *(_card(e, drawn, folder) for e in members),
        ]
    return "\n\n".join(parts) + "\n"


def _card(effect: Effect, drawn: Container[str], folder: str) -> str:
    card = effect.card
    rows = {
        "acts on": ", ".join(effect.owners),
        "typical size": card.typical,
        "shown by": card.excitation,
        "source": card.source,
        "note": "a defect of the computation, not physics" if card.numerics else "",
    }
    parts = [f"### {effect.id}", f"**{card.title}.** {card.explanation}", f"```\n{card.law}\n```"]
    pictures = {
        f"{effect.id}.svg": "its torque, drawn",
        f"{effect.id}.signature.svg": "what it leaves in the residuals",
    }
    parts += [f"![{effect.id}: {said}]({folder}/{name})" for name, said in pictures.items() if name in drawn]
    parts.append("| | |\n| --- | --- |" + "".join(f"\n| {k} | {_cell(v)} |" for k, v in rows.items() if v))
    if effect.parameters:
        lines = (
            f"\n| `{p.name}` | {p.unit} | {null_text(p)} | {SIGNS[p.sign]} | {p.start:.3g} | {remark_text(p)} |"
            for p in effect.parameters
        )
        parts.append("| parameter | unit | null value | sign | start | |\n" + "| --- " * 6 + "|" + "".join(lines))
    if card.look_alikes:
        parts.append("Hard to tell from:")
        parts.append("\n".join(f"- [{other}](#{other}): {reason}" for other, reason in card.look_alikes.items()))
    return "\n\n".join(parts)


def _cell(text: str) -> str:
    """A bar would end the cell."""
    return text.replace("|", "\\|")
