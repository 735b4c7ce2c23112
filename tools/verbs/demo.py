# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope demo`: tells the whole story on a simulated Doggy with a soft bearing, from bag to report."""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

from jointscope.robots.errors import JointscopeError
from jointscope.tools.writing.whole_file import check_outputs, write_json

DESCRIPTION = (
    "Simulates recordings of a robot with a soft bearing, lets `discover` find what the model lacks,\n"
    "checks the result against the truth, and writes everything into a folder. Takes two minutes."
)
EXAMPLE = """example:
  jointscope demo -o demo"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, default=Path("demo"), help="folder; default demo")
    parser.add_argument("--seconds", metavar="S", type=float, default=14.0, help="of the training recording [s]")
    parser.add_argument("--seed", metavar="N", type=int, default=1, help="of the simulated robot; default 1")
    parser.add_argument(
        "--effect",
        metavar="ID@OWNER",
        action="append",
        help="hide this effect instead of the soft bearing; may be repeated",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was found as JSON")


def run(args: argparse.Namespace) -> int:
    """Tells the story in a hidden folder and shows it under its name only when it is complete."""
    folder: Path = args.output
    if folder.exists() and not folder.is_dir():
        raise JointscopeError(f"cannot write into {folder}: it is a file; expected a folder, or a new name")
    check_outputs([folder / "found.yaml" if folder.is_dir() else folder, args.json])
    from jointscope.tools.verb_parts.demo_story import SOFT_BEARING, DemoStory

    try:
        with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as hidden:
            effects = args.effect or [SOFT_BEARING]
            found = DemoStory(Path(hidden), folder, args.seconds, args.seed, effects).tell()
            folder.mkdir(exist_ok=True)
            for file in sorted(Path(hidden).iterdir()):
                os.replace(file, folder / file.name)
    except OSError as err:
        raise JointscopeError(f"cannot write into {folder}: {err.strerror or err}") from err
    if args.json is not None:
        write_json(args.json, found)
    print(_where_to_look(folder))
    return 0


def _where_to_look(folder: Path) -> str:
    return f"""
5. Look at it:
   {folder}/discovery.html      what was missing, and why (open it in a browser)
   {folder}/found.yaml          the robot file with the effect, values and sigmas
   {folder}/story.svg           error step by step, and the worst moment before and after
   $ jointscope view {folder}/discovery.rrd
   $ jointscope compare {folder}/found.step0.yaml {folder}/found.yaml {folder}/test.mcap"""
