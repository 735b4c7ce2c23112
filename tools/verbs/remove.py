# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope remove`: takes a physical effect out of a robot file, with all its parameters."""

from __future__ import annotations

import argparse
from typing import Any

from jointscope.tools.edited_robot import add_edit_arguments, edit_robot, only_in

EXAMPLE = """example:
  jointscope remove doggy_bearing.yaml bearing_flexibility@joint1 -o doggy_rigid.yaml

The other parameters keep their values; calibrate again, because they were found beside the effect."""


def add_parser(subparsers: Any) -> None:
    """Adds the verb to the command line."""
    parser = subparsers.add_parser(
        "remove",
        help="takes a physical effect out of a robot file, with all its parameters",
        description="Writes a robot file with one physical effect less; comments of the file survive.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_edit_arguments(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Removes, writes, and says what is gone."""
    from jointscope.robots.effect_editing import remove_effect

    before, after = edit_robot(args, remove_effect)
    gone = ", ".join(p.name for p in only_in(before, after))
    print(f"{args.effect} removed from {before.name}{f': {gone}' if gone else ''}")
    print(f"\nWrote {args.output}; jointscope calibrate {args.output} BAG -o CALIBRATED.yaml finds the values again")
    return 0
