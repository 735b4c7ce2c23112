# SPDX-License-Identifier: BSD-3-Clause
"""Errors of an estimation together with what looked odd in the recordings, and with what to type next."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Concatenate, ParamSpec, TypeVar

from jointscope.graphs.screening.felt_gravity import FELT_GRAVITY
from jointscope.graphs.screening.mistaken_torque_sensors import MISTAKEN_TORQUE
from jointscope.graphs.screening.mistaken_transmission import MISTAKEN_TRANSMISSION
from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.robots.errors import SolveError
from jointscope.robots.model.command_words import bag_arguments, edited_argument, init_command, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.recordings.target_plausibility import LATE_TRACKER, MOVED_TRACKER

SUSPICIOUS = ("gap", *PLAIN_MISTAKES, LATE_TRACKER, MOVED_TRACKER)  # kinds of notices that may explain a failure
CULPRITS = (FELT_GRAVITY, MISTAKEN_TORQUE, MISTAKEN_TRANSMISSION)  # they say what to write, and spoil everything else
MOST = 3

P = ParamSpec("P")
T = TypeVar("T")


def with_notices(message: str, recordings: Sequence[Recording], notices: Sequence[Notice]) -> str:
    """A failure with what the screening and the reader saw, unless the message says it already."""
    everything = [*notices, *(notice for recording in recordings for notice in recording.notices)]
    texts = dict.fromkeys(notice.text for notice in everything if notice.kind in SUSPICIOUS)
    said = [text for text in texts if text in message]
    return "; ".join([message, *[text for text in texts if text not in said][: max(MOST - len(said), 0)]])


def next_commands(message: str, robot: Robot, recordings: Sequence[Recording]) -> str:
    """A failure with the commands that look for its reason, unless it names one already."""
    if "jointscope " in message or not recordings:
        return message
    name, bag = robot_argument(robot), bag_arguments([recordings[0].path])
    text = f"{message}; `jointscope info {bag} --robot {name}` says whether they fit each other"
    if robot.effects:
        last, output = shlex.quote(robot.effects[-1].label), edited_argument(robot, "without")
        return f"{text}, `jointscope remove {name} {last} -o {output}` takes out the effect that was added last"
    return f"{text}, `{init_command(robot, recordings[0].path, 'anew')}` finds start values"


def names_notices(
    function: Callable[Concatenate[Robot, Sequence[Recording], P], T],
) -> Callable[Concatenate[Robot, Sequence[Recording], P], T]:
    """Decorates what learns from recordings: its SolveErrors name what looked odd in them and what to type next."""

    @wraps(function)
    def named(robot: Robot, recordings: Sequence[Recording], *args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return function(robot, recordings, *args, **kwargs)
        except SolveError as err:
            notices = [notice for recording in recordings for notice in screen_all(recording, robot)]
            message = with_notices(str(err), recordings, notices)
            if any(notice.kind in CULPRITS for notice in notices):  # no effect is to blame
                raise SolveError(f"{message}; mend that first") from err
            raise SolveError(next_commands(message, robot, recordings)) from err

    return named
