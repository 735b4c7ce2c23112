# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope remove`: takes physical effects out of a robot file, with all their parameters."""

from __future__ import annotations

import argparse

from jointscope.tools.verb_parts.edited_robot import add_edit_arguments, edit_robot, notes, only_in

DESCRIPTION = "Removes one or more physical effects from a robot file; comments of the file survive."
EXAMPLE = """example:
  jointscope remove doggy_bearing.yaml bearing_flexibility@joint1 -o doggy_rigid.yaml
  jointscope remove arm.yaml 'motor_viscous@*' cogging@elbow -o arm_plain.yaml

ID@* means that effect wherever the robot has it. The other parameters keep their values; calibrate again, because they
were found beside the effect."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    add_edit_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Removes, writes, and says what is gone."""
    from jointscope.robots.files.effects_at_once import remove_effects
    from jointscope.robots.model.command_words import edited_path

    before, edited = edit_robot(args, remove_effects)
    gone = ", ".join(p.name for p in only_in(before, edited.robot))
    print(f"{', '.join(edited.labels)} removed from {before.name}{f': {gone}' if gone else ''}{notes(edited)}")
    calibrated = edited_path(args.output, "calibrated")
    print(f"\nWrote {args.output}; jointscope calibrate {args.output} BAG -o {calibrated} finds the values again")
    return 0
