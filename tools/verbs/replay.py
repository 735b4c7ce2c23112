# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope replay`: runs the fixed-lag estimator over a recording, message by message as in the control loop."""

from __future__ import annotations

import argparse
import math
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from jointscope.robots.errors import RecordingError, SolveError
from jointscope.tools.terminal.progress import progress_bar
from jointscope.tools.verb_parts.result_files import ResultFiles, add_result_options, write_replay
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.state_table import check_table_name, state_table
from jointscope.tools.writing.whole_file import check_outputs

if TYPE_CHECKING:
    from jointscope.graphs.fixed_lag.replay.replay_result import ReplayResult
    from jointscope.robots.model.robot import Robot
    from jointscope.tools.bags.read_arrivals import ArrivalReader
    from jointscope.tools.terminal.progress import Progress

BATCH_SECONDS = 120.0  # longer recordings are compared with the batch smoother only on request
DESCRIPTION = "Feeds a recording to the estimator of the control loop and shows states, residuals and latency."
EXAMPLE = """example:
  jointscope replay doggy_calibrated.yaml run.mcap --lag 0.1 --rrd run.rrd --report run.html

Messages come in the order and at the times at which they were received, including late, repeated and broken ones. With
-o the states go to a table, one row per command. With --live the viewer shows them while they are estimated."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument("bag", metavar="BAG", type=Path, help=".bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument("--lag", metavar="S", type=_positive, default=0.1, help="length of the window [s]; default 0.1")
    parser.add_argument(
        "--adapt",
        metavar="NAME=DENSITY",
        type=_adapted,
        action="append",
        default=[],
        help="let a parameter walk, with this density [its unit / sqrt(s)]; may be repeated",
    )
    parser.add_argument(
        "--lagged-every",
        metavar="N",
        type=_count,
        default=20,
        help="read the state at the lag at every N-th tick; default 20",
    )
    parser.add_argument("-o", "--output", metavar="STATES", type=Path, help="table of the states, .parquet or .csv")
    parser.add_argument(
        "--batch",
        action=argparse.BooleanOptionalAction,
        help=f"compare with the batch smoother (by default for recordings up to {BATCH_SECONDS:g} s)",
    )
    parser.add_argument("--live", action="store_true", help="show it in the viewer while it runs")
    parser.add_argument(
        "--speed", metavar="X", type=_positive, help="run at X times real time; as fast as possible if not given"
    )
    add_effects_option(parser)
    add_result_options(parser)


def run(args: argparse.Namespace) -> int:
    """Replays, writes the files, and says what was found."""
    files = ResultFiles(args.report, args.rrd, args.json, figures=args.figures)
    robot_file = [Path(args.robot)] if Path(args.robot).is_file() else []
    outputs = [args.output, *files.all]
    if args.output is not None:
        check_table_name(args.output)
    check_outputs(outputs, inputs=[args.bag, *robot_file, *args.effects])
    load_user_effects(args.effects)
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.notebook.robot_as_recorded import robot_as_recorded
    from jointscope.tools.terminal.replay_text import replay_text

    robot, said = robot_as_recorded(load_robot(args.robot), args.bag)
    with progress_bar() as progress, ExitStack() as stack:
        result, left_out = _replayed(args, robot, progress, stack)
        write_replay(result, files)
    print(replay_text(result))
    for notice in [*said, *left_out]:
        print(f"note: {notice}")
    files.tell(args.output)
    return 0


def _replayed(
    args: argparse.Namespace, robot: Robot, progress: Progress, stack: ExitStack
) -> tuple[ReplayResult, list[str]]:
    """The replay with all that listens to it, and what was left out; the table is complete when `stack` closes."""
    from jointscope.graphs.fixed_lag.replay.replay import replay
    from jointscope.tools.bags.read_arrivals import ArrivalReader
    from jointscope.tools.verb_parts.replay_listeners import Listeners, Pace

    adapt = dict(args.adapt)
    listeners = Listeners()
    table = stack.enter_context(state_table(args.output, robot, tuple(adapt))) if args.output is not None else None
    if table is not None:
        listeners.add(table.add)
    if args.live:
        from jointscope.tools.rerun_log.live_replay import live_replay

        listeners.add(stack.enter_context(live_replay(robot, tuple(adapt))).add)
    if args.speed:
        listeners.add(Pace(args.speed))
    arrivals = ArrivalReader(
        args.bag, robot, lambda done, expected: progress(f"replaying {args.bag.name}", done / max(expected, 1))
    )
    listener = listeners.call if listeners else None
    result = replay(robot, arrivals, args.lag, adapt=adapt, smoothed_every=args.lagged_every, listener=listener)
    if table is not None:
        table.finish()
    left_out = arrivals.notices()
    return _with_source(result, args, arrivals, progress), left_out


def _with_source(
    result: ReplayResult, args: argparse.Namespace, arrivals: ArrivalReader, progress: Progress
) -> ReplayResult:
    """The result with where it comes from, and with the agreement with the batch where that is wanted."""
    from dataclasses import replace

    result = replace(result, source=arrivals.source(result.recording_seconds, args.robot))
    wanted = args.batch if args.batch is not None else result.recording_seconds <= BATCH_SECONDS
    if not wanted or not len(result.lagged.times):
        return result
    from jointscope.graphs.fixed_lag.replay.batch_agreement import batch_agreement
    from jointscope.tools.bags.read_recording import read_recording

    progress("batch smoother", 0.5)
    lagged, robot = result.lagged, result.robot
    try:
        recording = read_recording(args.bag, robot)
        if recording.shortened:
            return replace(result, no_agreement="behind a long hole in the recording the estimator begins anew")
        later = arrivals.seconds_later(recording)
        found = batch_agreement(robot, recording, lagged.times, lagged.mean, lagged.sigma, later)
    except (RecordingError, SolveError) as err:
        if args.batch:
            raise
        return replace(result, no_agreement=f"the batch smoother cannot work on this recording: {err}")
    return replace(result, agreement=found)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (value > 0.0 and math.isfinite(value)):
        raise argparse.ArgumentTypeError(f"expected a number above zero, got {text!r}")
    return value


def _count(text: str) -> int:
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"expected a whole number above zero, got {text!r}")
    return int(text)


def _adapted(text: str) -> tuple[str, float]:
    name, sign, density = text.partition("=")
    if not (name and sign):
        raise argparse.ArgumentTypeError(f"expected NAME=DENSITY such as joint1.stiffness=0.5, got {text!r}")
    return name, _positive(density)
