# SPDX-License-Identifier: BSD-3-Clause
"""The option --leave-out: stretches of a recording in which something acted that does not belong to the robot."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import bag_arguments
from jointscope.robots.recordings.recording import Recording

FORM = "[BAG:]T0:T1"


def add_leave_out_option(parser: argparse.ArgumentParser) -> None:
    """Adds --leave-out."""
    parser.add_argument(
        "--leave-out",
        metavar=FORM,
        action="append",
        default=[],
        help="seconds of a recording in which somebody pushed the robot, for example 8.0:8.4, or run.mcap:8.0:8.4 "
        "where there are several; counted from the first stamp that the robot uses, as in all reports. The equations "
        "of motion are not applied there, and no model is judged there; may be repeated",
    )


def leave_out(recordings: Sequence[Recording], texts: Sequence[str]) -> list[Recording]:
    """The recordings with what --leave-out says.

    Raises:
        RecordingError: a text has another form, or names none or several of the recordings.
    """
    stretches: list[list[tuple[float, float]]] = [[] for _ in recordings]
    for text in texts:
        name, t0, t1 = _parts(text)
        meant = [i for i, r in enumerate(recordings) if not name or Path(name) == Path(r.path)]
        meant = meant or [i for i, r in enumerate(recordings) if name == Path(r.path).name]
        if len(meant) != 1:
            names = ", ".join(r.path for r in recordings)
            reason = f"{len(meant)} recordings are meant" if meant else f"there is no recording {name}"
            raise RecordingError(f"--leave-out {text}: {reason}; expected {FORM} with BAG one of {names}")
        stretches[meant[0]].append((t0, t1))
    return [r.leaving_out(s) if s else r for r, s in zip(recordings, stretches, strict=True)]


def left_out_arguments(recordings: Sequence[Recording]) -> list[str]:
    """What --leave-out has to be given to leave the same stretches out again."""
    return [f"{recording.path}:{t0:g}:{t1:g}" for recording in recordings for t0, t1 in recording.left_out]


def recording_arguments(recordings: Sequence[Recording]) -> str:
    """What a user types to name recordings, without the stretches that he left out of them."""
    options = [f"--leave-out {shlex.quote(stretch)}" for stretch in left_out_arguments(recordings)]
    return " ".join([bag_arguments((recording.path for recording in recordings), otherwise="BAG"), *options])


def _parts(text: str) -> tuple[str, float, float]:
    *name, t0, t1 = text.rsplit(":", 2) if text.count(":") else ("", "", "")
    try:
        return "".join(name), float(t0), float(t1)
    except ValueError:
        raise RecordingError(f"--leave-out {text}: expected {FORM} with times in seconds, as 8.0:8.4") from None
