# SPDX-License-Identifier: BSD-3-Clause
"""The option --workers: how many processes fit candidates side by side."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jointscope.graphs.discovery.side_by_side import SideBySide


def add_workers_option(parser: argparse.ArgumentParser) -> None:
    """Adds --workers, which the verbs take that fit several models."""
    parser.add_argument(
        "--workers",
        metavar="N",
        type=_count,
        default=0,
        help="processes that fit candidates in parallel; default: one per core; the result does not depend on it",
    )


def workers_of(args: argparse.Namespace) -> SideBySide:
    """The processes that were asked for; none has begun."""
    from jointscope.graphs.discovery.side_by_side import SideBySide, available_cores

    return SideBySide(args.workers or available_cores(), args.effects)


def _count(text: str) -> int:
    """A number of processes."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a number of processes from 1 on, got {text!r}")
    return int(text)
