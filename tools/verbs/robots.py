# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope robots`: lists the ready robots, or prints the file of one as a start for your own."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointscope.robots.errors import RobotError
from jointscope.tools.terminal.text_table import text_table
from jointscope.tools.writing.whole_file import check_outputs, write_json

DESCRIPTION = "Lists the ready robots. With a name: prints its file, a start for your own robot."
EXAMPLE = """examples:
  jointscope robots
  jointscope robots doggy > my_robot.yaml"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("name", metavar="NAME", nargs="?", help="a ready robot")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def run(args: argparse.Namespace) -> int:
    """Lists, or prints one."""
    check_outputs([args.json])
    from jointscope.robots.files.robot_file import READY_PREFIX
    from jointscope.robots.model.command_words import READY_ROOT, ready_robots
    from jointscope.robots.yaml_document import read_document
    from jointscope.robots.yaml_section import did_you_mean

    ready = ready_robots()
    if args.name is None:
        described = {name: str(read_document(path).get("description", "")) for name, path in ready.items()}
        if args.json is not None:
            write_json(args.json, {"robots": described})
        print(text_table(["robot", "description"], [[name, text] for name, text in described.items()], "<<", 0))
        return 0
    if args.name not in ready:
        raise RobotError(f"no ready robot {args.name!r}{did_you_mean(args.name, list(ready))}")
    path = ready[args.name]
    document = read_document(path)
    if args.json is not None:
        write_json(args.json, document)
    # elsewhere the file must still find the URDF of the package
    folder = path.parent.relative_to(READY_ROOT).as_posix()
    text = path.read_text(encoding="utf-8")
    print(text.replace(f"urdf: {document['urdf']}", f"urdf: {READY_PREFIX}{folder}/{document['urdf']}"), end="")
    return 0
