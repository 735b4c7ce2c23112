# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope add`: adds physical effects to a robot file; calibration then finds their sizes."""

from __future__ import annotations

import argparse

from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.verb_parts.edited_robot import add_edit_arguments, edit_robot, notes, only_in

DESCRIPTION = "Adds one or more physical effects to a robot file; comments of the file survive."
EXAMPLE = """example:
  jointscope add doggy bearing_flexibility@joint1 -o doggy_bearing.yaml
  jointscope calibrate doggy_bearing.yaml train.mcap -o doggy_calibrated.yaml
  jointscope add arm.yaml 'motor_viscous@*' cogging@elbow -o arm_friction.yaml

ID@* means everything that the effect can act on. A joint declared rigid gets the spring that an effect needs.
`jointscope effects` lists the effects, `jointscope diagnose` tells which one is missing."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    add_edit_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Adds, writes, and says what a calibration will find."""
    from jointscope.robots.files.effects_at_once import add_effects
    from jointscope.robots.model.command_words import edited_path
    from jointscope.tools.presentation.numbers import significant

    before, edited = edit_robot(args, add_effects)
    rows = [
        [p.name, significant(p.value), p.unit, f"{significant(p.prior)} ± {significant(p.prior_sigma, 2)}"]
        for p in only_in(edited.robot, before)
    ]
    print(f"{', '.join(edited.labels)} added to {before.name}{notes(edited)}")
    if rows:
        print(text_table(["parameter", "start", "unit", "prior"], rows, "<><<"))
    calibrated = edited_path(args.output, "calibrated")
    print(f"\nWrote {args.output}; jointscope calibrate {args.output} BAG -o {calibrated} finds the values")
    return 0
