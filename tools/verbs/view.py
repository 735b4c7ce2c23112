# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope view`: opens an .rrd file in the rerun viewer."""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from jointscope.robots.errors import JointscopeError, RecordingError
from jointscope.robots.outside_modules import need_module

DESCRIPTION = "Opens an .rrd file, as the other verbs write it with --rrd, in the rerun viewer."
EXAMPLE = """example:
  jointscope calibrate doggy calibration.mcap -o doggy_calibrated.yaml --rrd run.rrd
  jointscope view run.rrd"""

MAGIC = (b"RRF2", b"RRF1", b"RRF0")  # first bytes of the viewer's files


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("file", metavar="F.rrd", type=Path, help="file to open")


def run(args: argparse.Namespace) -> int:
    """Starts the viewer and waits until it is closed."""
    check_file(args.file)
    need_module("rerun")
    try:
        # as a module of this interpreter: the viewer's program need not be on the path
        finished = subprocess.run([sys.executable, "-m", "rerun", str(args.file)], check=False)
    except OSError as err:
        raise JointscopeError(f"cannot start the viewer: {err.strerror or err}") from err
    if finished.returncode not in (0, -2, 130):  # closed, or interrupted by the user
        raise JointscopeError(
            f"the viewer stopped with code {finished.returncode}; without a display, copy {args.file} to a machine "
            "that has one, or try `python -m rerun --web-viewer`"
        )
    return 0


def check_file(path: Path) -> None:
    """Complains about a file that the viewer could not open.

    Raises:
        RecordingError: there is no such file, or it is not the viewer's.
    """
    if not path.is_file():
        raise RecordingError(f"no file {path}; the verbs write one with --rrd F.rrd")
    try:
        with path.open("rb") as file:
            first = file.read(4)
    except OSError as err:
        raise RecordingError(f"cannot read {path}: {err.strerror or err}") from err
    if first not in MAGIC:
        raise RecordingError(f"{path} is not a file of the rerun viewer (.rrd); expected one written with --rrd")
