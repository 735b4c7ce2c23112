# SPDX-License-Identifier: BSD-3-Clause
"""What looks odd in recordings, said before the computation begins: minutes with swapped axes teach nothing."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TextIO

from jointscope.graphs.screening.encoder_jumps import JUMP
from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.recordings.target_plausibility import LATE_TRACKER, MOVED_TRACKER
from jointscope.tools.bags.errors_of import errors_of
from jointscope.tools.bags.read_motion import REST_TOUR
from jointscope.tools.terminal.progress import ERASE_LINE

LIMIT = "limit"
CONTRADICTED = (
    "Look at this first: what is wrong in the robot file is mended there; a model that contradicts its recording takes "
    "long to calibrate (Ctrl-C ends it).\n"
)
BEYOND_LIMITS = (
    "Look at this first: a limit of the URDF may be wrong, or a unit; the calibration goes on without limits.\n"
)
RESTS = "Look at this first: rests take seconds as such, and minutes as motion (Ctrl-C ends it).\n"
JUMPED = "Look at this first: values of a recording in which an encoder jumps are those of no robot.\n"


def first_look(robot: Robot, recordings: Sequence[Recording], stream: TextIO | None = None) -> None:
    """Screens all recordings and prints what looks like a plain mistake.

    Args:
        robot: as the user gave it.
        recordings: everything that will be used, the held-out one included.
        stream: where to print; standard error by default.

    Raises:
        RecordingError: a recording cannot be a measurement of this robot; the message says which one.
    """
    stream = stream or sys.stderr
    seen: dict[str, str] = {}
    kinds = set()
    for recording in recordings:
        tours = [notice for notice in recording.notices if notice.kind == REST_TOUR]
        for notice in (*tours, *_screened(recording, robot)):
            if notice.kind in (*PLAIN_MISTAKES, LIMIT, LATE_TRACKER, MOVED_TRACKER, REST_TOUR):
                seen.setdefault(notice.text, recording.path)
                kinds.add(notice.kind)
    if not seen:
        return
    lead = ERASE_LINE if stream.isatty() else ""
    for text, path in seen.items():
        stream.write(f"{lead}{path}: {text}\n")
    leads = {LIMIT: BEYOND_LIMITS, JUMP: JUMPED, REST_TOUR: RESTS}
    stream.write(leads.get(kinds.pop(), CONTRADICTED) if len(kinds) == 1 else CONTRADICTED)
    stream.flush()


def _screened(recording: Recording, robot: Robot) -> list[Notice]:
    with errors_of(recording.path):
        return screen_all(recording, robot)
