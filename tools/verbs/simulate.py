# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope simulate`: simulates a robot with MuJoCo, and writes a bag and the truth beside it."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jointscope.robots.errors import SimulationError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.simulator import DEFAULT_SECONDS, Simulation, simulate_under
from jointscope.tools.simulator.effect_list import effect_list
from jointscope.tools.simulator.effects_of_file import not_simulated, not_simulated_text
from jointscope.tools.terminal.progress import progress_bar
from jointscope.tools.verb_parts.simulation_options import add_simulation_options, conditions_of
from jointscope.tools.verb_parts.simulations.options_of_kinds import refuse_other_options
from jointscope.tools.verb_parts.simulations.resting import add_resting_options, simulate_resting
from jointscope.tools.verb_parts.simulations.shaken import add_shaking_options, simulate_shaken
from jointscope.tools.verb_parts.user_effects import add_effects_option, load_user_effects
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json

DESCRIPTION = "Simulates a robot with MuJoCo and writes a bag and the truth beside it."
EXAMPLE = """example:
  jointscope simulate doggy -o train.mcap --seed 3 --friction smooth --effect bearing_flexibility@joint1
  jointscope simulate doggy -o test.mcap --motion moves --seed 3 --friction smooth --effect bearing_flexibility@joint1
  jointscope simulate tx90l --kind poses -o poses.csv --seed 3 --effect encoder_eccentricity@joint4
  jointscope simulate tx90l --kind frequency -o shaken --seed 3 --pose 0.1,0.72,0.62,1.2,1.0,0.3 --pose 0,0.5,1.8,0,1,0
  jointscope simulate biorob --kind rests -o bench.mcap --seed 3 --count 12 --weights 0,0.1,0.2

The same seed gives the same robot; the truth is written beside the bag as train.truth.json."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.epilog = f"{EXAMPLE}\n\n{effect_list()}"
    defaults = ", ".join(f"{seconds:g} for {motion}" for motion, seconds in DEFAULT_SECONDS.items())
    parser.add_argument("robot", metavar="ROBOT", help="name of a ready robot, or a robot file")
    parser.add_argument(
        "-o", "--output", metavar="BAG", type=Path, required=True, help=".bag, .mcap, .db3 or a folder; .csv of poses"
    )
    parser.add_argument(
        "--kind",
        choices=tuple(KINDS),
        help="motion: a bag; rests: a bag of a robot that is brought to rest, with weights on it or without; poses: a "
        "table (.csv) of an arm at rest with a tracker; frequency: a folder of bags of an arm that is shaken; default: "
        "what the robot has",
    )
    counts = "number of poses; default 40, or 2 if shaken; of rests: as many as make 30, at least 8"
    parser.add_argument("--count", type=int, metavar="N", help=counts)
    turned = "of poses: the tracker also measures the orientation of every target"
    parser.add_argument("--orientation", action="store_true", help=turned)
    parser.add_argument(
        "--session", default="poses", metavar="NAME", help="a different name gives different poses of the arm"
    )
    add_resting_options(parser)
    add_shaking_options(parser)
    parser.add_argument(
        "--motion",
        choices=list(DEFAULT_SECONDS),
        help="calibration: rest, slow and fast motion, chirps; moves: others, to test a model; default calibration",
    )
    parser.add_argument("--seconds", type=float, metavar="S", help=f"duration [s]; default {defaults}")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of robot, motion and noise; default 0")
    add_simulation_options(parser, ", of rests 200")
    add_effects_option(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")


def run(args: argparse.Namespace) -> int:
    """Simulates, writes bag, truth and JSON, and says what was done."""
    truth_file = args.output.parent / f"{args.output.stem}.truth.json"
    check_outputs([args.output if args.output.suffix else None, truth_file, args.json], inputs=args.effects)
    load_user_effects(args.effects)
    robot = load_robot(args.robot)
    kind = args.kind or ("motion" if robot.motion else "poses")
    refuse_other_options(args, kind)
    return KINDS[kind](robot, args, truth_file)


def _motion(robot: Robot, args: argparse.Namespace, truth_file: Path) -> int:
    """Simulates a robot that moves, and writes the bag and the truth."""
    with progress_bar() as progress:
        simulation = _simulate(robot, args, lambda share: progress("simulating", share))
    write_bag(args.output, simulation.recording, robot)
    write_json(truth_file, simulation.truth)
    summary = _summary(simulation, robot, args.output, truth_file)
    if args.json is not None:
        write_json(args.json, summary)
    print(_as_text(summary))
    return 0


def _poses(robot: Robot, args: argparse.Namespace, truth_file: Path) -> int:
    """Simulates poses, and writes the table and the truth.

    Raises:
        SimulationError: an option of recordings of motion, or another file than a table.
    """
    from jointscope.tools.bags.at_poses.pose_table import pose_table
    from jointscope.tools.bags.clocks.durations import counted
    from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses
    from jointscope.tools.verb_parts.simulation_options import assignments

    if args.output.suffix.lower() != ".csv":
        raise SimulationError(f"{args.output}: poses are written as a table; expected a name that ends with .csv")
    conditions = PoseConditions(assignments(args.set), args.effect, orientation=args.orientation)
    poses, truth = simulate_poses(robot, args.count or 40, args.seed, conditions, args.session)
    with whole_file(args.output) as path:
        path.write_text(pose_table(poses, robot), encoding="utf-8")
    write_json(truth_file, truth)
    if args.json is not None:
        write_json(args.json, {"table": str(args.output), "truth_file": str(truth_file), "truth": truth})
    effects = ", ".join(f"{e['effect']}@{e['owner']}" for e in truth["effects"]) or "none"
    print(f"{args.output}: {counted(len(poses), 'pose')} of {robot.name}, seed {args.seed}")
    print(f"  effects: {effects}\n  truth:   {truth_file}")
    return 0


def _simulate(robot: Robot, args: argparse.Namespace, progress: Callable[[float], None]) -> Simulation:
    motion = args.motion or "calibration"
    seconds = DEFAULT_SECONDS[motion] if args.seconds is None else args.seconds
    return simulate_under(conditions_of(args), robot, motion, seconds, args.seed, progress)


def _summary(simulation: Simulation, robot: Robot, bag: Path, truth_file: Path) -> dict[str, Any]:
    streams = simulation.recording.streams.values()
    return {
        "bag": str(bag),
        "truth_file": str(truth_file),
        "samples": {stream.name: len(stream) for stream in streams},
        **not_simulated(robot, simulation.truth),
        "truth": simulation.truth,
    }


def _as_text(summary: dict[str, Any]) -> str:
    truth = summary["truth"]
    effects = ", ".join(f"{e['effect']}@{e['owner']}" for e in truth["effects"]) or "none"
    samples = ", ".join(f"{name} {count}" for name, count in summary["samples"].items())
    left = not_simulated_text(summary)
    note = f"\n{left}" if left else ""
    return (
        f"{summary['bag']}: {truth['seconds']:g} s of {truth['robot']}, motion {truth['motion']}, "
        f"seed {truth['seed']}, {truth['friction']} friction\n"
        f"  effects: {effects}\n  samples: {samples}\n  truth:   {summary['truth_file']}{note}"
    )


KINDS = {"motion": _motion, "rests": simulate_resting, "poses": _poses, "frequency": simulate_shaken}
