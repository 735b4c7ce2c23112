# SPDX-License-Identifier: BSD-3-Clause
"""ROBOT BAG... [--holdout BAG]: what the verbs take that learn from recordings and are judged by another one."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.presentation.left_out import add_leave_out_option, leave_out
from jointscope.tools.terminal.progress import Progress, reading
from jointscope.tools.verb_parts.pose_runs import check_one_kind, given_once
from jointscope.tools.verb_parts.user_effects import add_effects_option

KINDS = {
    "poses": ("TABLE-or-BAG", "poses of the arm at rest with a measured target (docs/poses.md)", "poses"),
    "rests": (
        "BAG",
        "recordings in which the robot repeatedly stands still, with or without weights (docs/rests.md)",
        "recordings of rests",
    ),
    "frequency": (
        "BAG",
        "recordings of the arm being shaken, in one pose each (docs/frequency.md)",
        "recordings of the arm shaken",
    ),
}
"""Recordings beside motion: what a user gives, what they are, and a word for them."""


def add_kind_options(parser: argparse.ArgumentParser, held_out: bool = False) -> None:
    """Adds an option for each kind of recordings beside motion, and one for those that are held out."""
    for kind, (metavar, what, word) in KINDS.items():
        options = {f"--{kind}": what}
        if held_out:
            options[f"--holdout-{kind}"] = f"{word} that are scored once per step, but never influence the choice"
        for option, text in options.items():
            parser.add_argument(option, nargs="+", type=Path, default=[], metavar=metavar, help=text)


def add_locked_option(parser: argparse.ArgumentParser) -> None:
    """Adds the option for recordings with locked springs."""
    parser.add_argument(
        "--locked-springs",
        nargs="+",
        type=Path,
        default=[],
        metavar="BAG",
        help="recordings in which springs are locked mechanically: they show the transmission matrix "
        "(docs/locked_springs.md)",
    )


def add_bag_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments."""
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument("bags", metavar="BAG", nargs="*", type=Path, help=".bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument(
        "--holdout", metavar="BAG", type=Path, help="a recording that is scored, but never influences the choice"
    )
    parser.add_argument(
        "--holdout-share",
        metavar="SHARE",
        type=float,
        help="hold out the last part of the only BAG instead, for example 0.33; zeros of encoders and biases of gyros "
        "are fitted again there",
    )
    add_kind_options(parser, held_out=True)
    add_leave_out_option(parser)
    add_effects_option(parser)


def input_files(args: argparse.Namespace) -> list[Path]:
    """Everything that must not be overwritten."""
    robot = [Path(args.robot)] if Path(args.robot).is_file() else []
    still = [*args.poses, *args.holdout_poses, *args.frequency, *args.holdout_frequency]
    still += [*args.rests, *args.holdout_rests]
    return [*robot, *args.bags, *([args.holdout] if args.holdout else []), *still, *args.effects]


def check_kind(args: argparse.Namespace) -> None:
    """Kinds of recordings that go together, and no option of another.

    Raises:
        RecordingError: none, kinds that do not go together, or such an option.
    """
    of_motion = {
        "--holdout": args.holdout is not None,
        "--holdout-share": args.holdout_share is not None,
        "--leave-out": bool(args.leave_out),
        "--scheduler": args.scheduler is not None,
        "--workers": args.workers > 1,
    }
    for kind in KINDS:
        _check_held_out(f"--{kind}", getattr(args, kind), getattr(args, f"holdout_{kind}"))
    check_one_kind(args.bags, args.poses, args.rests, of_motion, args.frequency)


def _check_held_out(option: str, given: Sequence[Path], held: Sequence[Path]) -> None:
    """Recordings of a kind that are held out go with others, and are none of these; not even a copy.

    Raises:
        RecordingError: there are no others, or one is the same.
    """
    if held and not given:
        raise RecordingError(f"--holdout-{option[2:]} goes with {option}")
    twice = next((path for path in held if path in given), None)
    if twice is not None:
        raise RecordingError(f"{twice} is given with {option} and held out; leave it out once")
    if held:
        given_once(f"--holdout-{option[2:]}", [*given, *held])


def read_bags(args: argparse.Namespace, robot: Robot, progress: Progress) -> tuple[list[Recording], Recording | None]:
    """The training recordings and the held-out one; says what looks like a plain mistake in them.

    Raises:
        RecordingError: a bag cannot be read or cannot be a measurement of this robot, the held-out one is also a
            training recording, or what is to be left out is not there.
    """
    from jointscope.tools.verb_parts.first_look import first_look

    recordings, holdout = _read(args, robot, progress)
    first_look(robot, [*recordings, *([holdout] if holdout is not None else [])])
    return recordings, holdout


def _read(args: argparse.Namespace, robot: Robot, progress: Progress) -> tuple[list[Recording], Recording | None]:
    """What the arguments name; arguments as in `read_bags`."""
    from jointscope.tools.bags.read_motion import read_motion

    recordings = [read_motion(bag, robot, reading(bag, progress)) for bag in args.bags]
    if args.holdout_share is not None:
        return _last_part_held_out(args, leave_out(recordings, args.leave_out))
    if args.holdout is None:
        return leave_out(recordings, args.leave_out), None
    holdout = read_motion(args.holdout, robot, reading(args.holdout, progress))
    _check_apart(recordings, holdout)
    *recordings, holdout = leave_out([*recordings, holdout], args.leave_out)
    return recordings, holdout


def _last_part_held_out(
    args: argparse.Namespace, recordings: Sequence[Recording]
) -> tuple[list[Recording], Recording | None]:
    """The first part of a recording for training, the last part held out."""
    if args.holdout is not None:
        raise RecordingError("--holdout and --holdout-share exclude each other; give one of them")
    if len(recordings) > 1:
        raise RecordingError(
            f"--holdout-share: expected a single BAG, got {len(recordings)}; hold one of them out with --holdout"
        )
    if not 0.05 <= args.holdout_share <= 0.95:
        raise RecordingError(f"--holdout-share {args.holdout_share:g}: expected a share from 0.05 to 0.95")
    (whole,) = recordings
    end = max(float(stream.times[-1]) for stream in whole.streams.values())
    cut = end - args.holdout_share * whole.duration
    return [whole.between(float("-inf"), cut)], whole.between(cut, float("inf"))


def _check_apart(recordings: Sequence[Recording], holdout: Recording) -> None:
    for recording in recordings:
        if holdout.shares_samples_with(recording):
            raise RecordingError(
                f"--holdout {holdout.path} is also a training recording ({recording.path}); hold out one that the "
                "model has not seen"
            )
