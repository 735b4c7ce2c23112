# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope effects`: lists the physical effects that a model may lack, or prints the card of one."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.effect import Effect

PICTURES = "pictures/effects"
"""Folder of the drawings, beside the page of the catalogue."""
DESCRIPTION = (
    "Lists the catalogue of physical effects. With an id, prints the card of that effect: equation\n"
    "and parameters, the motion that shows it, and what it is easily confused with."
)
EXAMPLE = """examples:
  jointscope effects
  jointscope effects bearing_flexibility
  jointscope effects --effects my_effects.py

docs/your_own_effect.md shows how to write an effect of your own."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("id", metavar="ID", nargs="?", help="an effect")
    add_effects_option(parser)
    parser.add_argument(
        "--page",
        type=Path,
        metavar="F.md",
        help=f"write the catalogue as a page of markdown; drawings of laws and of signatures go to {PICTURES}",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def run(args: argparse.Namespace) -> int:
    """Lists, or prints one card."""
    check_outputs([args.json, args.page], inputs=args.effects)
    from jointscope.robots.files.effect_catalogue import catalogue, find_effect
    from jointscope.tools.terminal.effect_text import card_text, effect_json, list_text

    load_user_effects(args.effects)
    if args.id is None:
        known = catalogue()
        content, text = {"effects": {e.id: effect_json(e) for e in known.values()}}, list_text(known.values())
    else:
        effect = find_effect(args.id)
        content, text = effect_json(effect), card_text(effect)
    if args.page is not None:
        _write_page(args.page, tuple(catalogue().values()))
    if args.json is not None:
        write_json(args.json, content)
    print(text)
    return 0


def _write_page(path: Path, effects: Sequence[Effect]) -> None:
    """The page, and beside it the folder of its pictures."""
    from jointscope.tools.report.law_picture import law_picture
    from jointscope.tools.report.signature_picture import signature_picture
    from jointscope.tools.terminal.effect_page import effect_page

    drawn = {f"{effect.id}.svg": law_picture(effect) for effect in effects}
    drawn |= {f"{effect.id}.signature.svg": signature_picture(effect) for effect in effects}
    pictures = {name: svg for name, svg in drawn.items() if svg is not None}
    folder = path.parent / PICTURES
    folder.mkdir(parents=True, exist_ok=True)
    for name, svg in pictures.items():
        with whole_file(folder / name) as file:
            file.write_text(svg, encoding="utf-8")
    with whole_file(path) as page:
        page.write_text(effect_page(effects, pictures, PICTURES), encoding="utf-8")
