# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope info`: what is in a bag, and whether a robot can use it."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jointscope.robots.errors import RecordingError
from jointscope.robots.robot_file import load_robot
from jointscope.tools.bags.describe_bag import describe_bag

EXAMPLE = """example:
  jointscope info calibration.mcap
  jointscope info calibration.mcap --robot doggy --json info.json"""

QUIET_SECONDS = 2.0  # [s] shorter work needs no progress bar


def add_parser(subparsers: Any) -> None:
    """Adds the verb to the command line."""
    parser = subparsers.add_parser(
        "info",
        help="topics, rates, gaps, jitter, clipping; what the robot file needs and what is there",
        description="Describes a bag; with --robot it also says whether that robot can use it, and why not.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bag", metavar="BAG", type=Path, help="a .bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument("--robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what the screen says as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Describes the bag; a bag that the robot cannot use is an answer, not a failure."""
    robot = load_robot(args.robot) if args.robot else None
    description = describe_bag(args.bag, robot, _progress_bar())
    if args.json is not None:
        _write_json(args.json, description.to_json())
    print(description.text())
    return 0


def _write_json(path: Path, content: dict[str, Any]) -> None:
    """Writes a file whole or not at all."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
        os.replace(temporary, path)
    except OSError as err:
        raise RecordingError(f"cannot write {path}: {err.strerror or err}") from err
    finally:
        temporary.unlink(missing_ok=True)


def _progress_bar() -> Callable[[int, int], None] | None:
    if not sys.stderr.isatty():
        return None
    begin = time.monotonic()

    def show(done: int, total: int) -> None:
        if time.monotonic() - begin < QUIET_SECONDS:
            return
        share = done / max(total, 1)
        end = "\n" if done >= total else ""
        print(f"\rreading [{'#' * round(30 * share):<30}] {share:4.0%}", end=end, file=sys.stderr, flush=True)

    return show
