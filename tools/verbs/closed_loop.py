# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope closed-loop`: runs controllers in the simulator, with and without the estimator."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from jointscope.robots.errors import SimulationError
from jointscope.tools.closed_loop.closed_loop_result import CONTROLLERS, SOURCES
from jointscope.tools.simulator.effect_list import effect_list
from jointscope.tools.terminal.progress import progress_bar
from jointscope.tools.verb_parts.result_files import ResultFiles, add_result_options, write_closed_loop
from jointscope.tools.verb_parts.simulation_options import add_simulation_options, conditions_of
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, write_json

DESCRIPTION = (
    "Lets the P-controller of Doggy's paper and a state feedback hit balls in MuJoCo, or the six "
    "controllers of the BioRob make far moves, each fed by the true "
    "state, by the fixed-lag estimator and by differentiated encoders."
)
EXAMPLE = """example:
  jointscope closed-loop doggy --seed 3 --friction smooth --report loop.html
  jointscope closed-loop biorob --sources true,encoders
  jointscope closed-loop doggy --model found.yaml --seed 3 --effect bearing_flexibility@joint1 --friction smooth

ROBOT is the simulated truth; controllers and estimator know the model only. The same seed is the same robot as in
`jointscope simulate`, so a model can be calibrated from a recording of the very robot that it then controls."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.epilog = f"{EXAMPLE}\n\n{effect_list()}"
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file: the truth")
    parser.add_argument(
        "--model",
        metavar="ROBOT_FILE",
        help="what controllers and estimator know; default: the truth without hidden effects, parameters a little off",
    )
    parser.add_argument("-o", "--output", metavar="BAG", type=Path, help="record state feedback with the estimator")
    parser.add_argument("--seconds", type=float, default=10.0, metavar="S", help="duration [s]; default 10")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of robot, hits and noise; default 0")
    parser.add_argument(
        "--controllers",
        metavar="LIST",
        help=f"of {', '.join(CONTROLLERS)}, separated by commas; default: those made for the robot, else the first two",
    )
    parser.add_argument(
        "--motion",
        choices=["hits", "moves"],
        help="hits of balls, or far moves of all joints; default moves for the BioRob, else hits",
    )
    parser.add_argument(
        "--sources",
        default=",".join(SOURCES),
        metavar="LIST",
        help=f"of {', '.join(SOURCES)}, separated by commas; default all",
    )
    parser.add_argument("--lag", type=float, default=0.1, metavar="S", help="of the estimator [s]; default 0.1")
    parser.add_argument(
        "--cutoff",
        type=float,
        default=40.0,
        metavar="HZ",
        help="low-pass of the differentiated encoders [Hz]; default 40",
    )
    parser.add_argument(
        "--mismatch",
        type=float,
        default=0.02,
        metavar="SHARE",
        help="without --model: how far its parameters are off, 1 sigma; default 0.02",
    )
    add_simulation_options(parser)
    add_effects_option(parser)
    add_result_options(parser)


def run(args: argparse.Namespace) -> int:
    """Runs all loops, writes the files, and says what was found."""
    bag = args.output
    files = ResultFiles(args.report, args.rrd, args.json, figures=args.figures)
    truth_file = None if bag is None else bag.parent / f"{bag.stem}.truth.json"
    robot_files = [name for name in (args.robot, args.model) if name is not None and Path(name).is_file()]
    outputs = [bag if bag is not None and bag.suffix else None, truth_file, *files.all]
    check_outputs(outputs, inputs=[*robot_files, *args.effects])
    from jointscope.robots.files.robot_file import load_robot
    from jointscope.tools.bags.write_bag import write_bag
    from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop
    from jointscope.tools.terminal.closed_loop_text import closed_loop_text

    load_user_effects(args.effects)
    robot = load_robot(args.robot)
    model = None if args.model is None else load_robot(args.model)
    options = LoopOptions(
        None if args.controllers is None else _names(args.controllers),
        _names(args.sources),
        lag=args.lag,
        cutoff=args.cutoff,
        mismatch=args.mismatch,
        motion=args.motion,
    )
    with progress_bar() as progress:
        result = run_closed_loop(robot, model, args.seconds, args.seed, conditions_of(args), options, progress, _warn)
        if bag is not None and truth_file is not None:
            write_bag(bag, result.recorded.recording, robot)
            write_json(truth_file, result.truth)
        write_closed_loop(result, files)
    print(closed_loop_text(result))
    if bag is not None:
        print(f"\n{bag} holds the run of {result.recorded.label}")
    files.tell(bag, truth_file)
    return 0


def _warn(line: str) -> None:
    print(f"jointscope: {line}", file=sys.stderr)


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if len(set(names)) < len(names):
        raise SimulationError(f"{text}: expected different names separated by commas")
    return names
