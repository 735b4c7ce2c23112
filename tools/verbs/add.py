# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope add`: adds a physical effect to a robot file; calibration then finds its size."""

from __future__ import annotations

import argparse
from typing import Any

from jointscope.tools.edited_robot import add_edit_arguments, edit_robot, only_in
from jointscope.tools.text_table import text_table

EXAMPLE = """example:
  jointscope add doggy bearing_flexibility@joint1 -o doggy_bearing.yaml
  jointscope calibrate doggy_bearing.yaml train.mcap -o doggy_calibrated.yaml

`jointscope effects` lists the effects, `jointscope diagnose` tells which one is missing."""


def add_parser(subparsers: Any) -> None:
    """Adds the verb to the command line."""
    parser = subparsers.add_parser(
        "add",
        help="adds a physical effect to a robot file; calibration then finds its size",
        description="Writes a robot file with one physical effect more; comments of the file survive.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_edit_arguments(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Adds, writes, and says what a calibration will find."""
    from jointscope.robots.effect_editing import add_effect
    from jointscope.tools.report.numbers import significant

    before, after = edit_robot(args, add_effect)
    rows = [
        [p.name, significant(p.value), p.unit, f"{significant(p.prior)} ± {significant(p.prior_sigma, 2)}"]
        for p in only_in(after, before)
    ]
    print(f"{args.effect} added to {before.name}")
    if rows:
        print(text_table(["parameter", "start", "unit", "prior"], rows, "<><<"))
    print(f"\nWrote {args.output}; jointscope calibrate {args.output} BAG -o CALIBRATED.yaml finds the values")
    return 0
