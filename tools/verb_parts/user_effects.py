# SPDX-License-Identifier: BSD-3-Clause
"""The option --effects: physical effects of the user's own, which robot files may name as those of the catalogue."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path


def add_effects_option(parser: argparse.ArgumentParser) -> None:
    """Adds --effects, which every verb takes that reads robot files."""
    parser.add_argument(
        "--effects",
        metavar="FILE.py",
        type=Path,
        action="append",
        default=[],
        help="a physical effect of your own; may be repeated",
    )


def effects_words(files: Sequence[Path]) -> list[str]:
    """--effects as it was typed, for a command that is to be typed next."""
    return [f"--effects {shlex.quote(str(file))}" for file in files]


def load_user_effects(files: Sequence[Path]) -> None:
    """Adds the files to the catalogue of effects.

    Raises:
        EffectError: a file cannot be read or holds no effect.
    """
    if not files:
        return
    from jointscope.robots.files.effect_catalogue import add_user_effects

    for file in files:
        add_user_effects(file)
