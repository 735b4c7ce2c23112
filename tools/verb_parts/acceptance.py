# SPDX-License-Identifier: BSD-3-Clause
"""--accept: a result against limits that the user has declared."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

from jointscope.robots.model.robot import Robot
from jointscope.tools.acceptance.evaluation import AcceptedBy, exit_code
from jointscope.tools.acceptance.limits import Limit, check_units, read_limits


def add_accept_option(parser: argparse.ArgumentParser) -> None:
    """Adds --accept."""
    parser.add_argument(
        "--accept",
        type=Path,
        metavar="LIMITS.yaml",
        help="limits that the result must meet (docs/accept.md); exit code 3 if one fails, 4 if one is not evaluated",
    )


def limits_of(args: argparse.Namespace, robots: Iterable[Robot]) -> tuple[Limit, ...]:
    """The limits that the user named, whose units fit the robots; none without --accept.

    Raises:
        RobotError: the file has a mistake, or a bound is in another unit than what it limits.
    """
    path = getattr(args, "accept", None)  # verbs that build on `compare` do not have it
    limits = () if path is None else read_limits(path)
    check_units(limits, robots)
    return limits


def print_acceptance(checked: AcceptedBy) -> int:
    """Says the lines of all models; returns the exit code."""
    from jointscope.tools.terminal.acceptance_text import acceptance_text

    if not checked:
        return 0
    print(f"\n{acceptance_text(checked)}")
    return exit_code([line for lines in checked.values() for line in lines])
