# SPDX-License-Identifier: BSD-3-Clause
"""`simulate --kind rests`: a robot that is brought to rest, with known weights; a bag and its truth."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import Any

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.simulator.effects_of_file import not_simulated, not_simulated_text
from jointscope.tools.verb_parts.simulation_options import conditions_of
from jointscope.tools.writing.whole_file import write_json


def add_resting_options(parser: argparse.ArgumentParser) -> None:
    """Adds --weights, --at and --hold."""
    group = parser.add_argument_group("recordings of --kind rests")
    group.add_argument(
        "--weights",
        metavar="KG,KG,...",
        help="that hang on a link in each posture, one after the other; 0 for none; default 0",
    )
    group.add_argument(
        "--at",
        metavar="LINK",
        help="of the URDF, at whose origin they hang; default: the farthest behind the last joint",
    )
    group.add_argument("--hold", type=float, metavar="S", help="how long a calm robot is left alone; default 1.5")


def simulate_resting(robot: Robot, args: argparse.Namespace, truth_file: Path) -> int:
    """Simulates, writes bag and truth, and says what was done and what comes next.

    Raises:
        SimulationError: numbers that cannot be, or weights that the robot cannot hold.
    """
    from jointscope.tools.simulator.rest_simulation import RATE, Resting, simulate_rests
    from jointscope.tools.terminal.progress import progress_bar

    if args.output.suffix.lower() == ".csv":
        raise SimulationError(f"{args.output}: rests are a bag; expected .bag, .mcap, .db3 or a folder")
    given = {"count": args.count, "at": args.at, "hold": args.hold, "masses": _masses(args.weights)}
    resting = Resting(**{name: value for name, value in given.items() if value is not None})
    with progress_bar() as progress:
        found = simulate_rests(
            robot, args.seed, conditions_of(args, RATE), resting, args.session, lambda s: progress("simulating", s)
        )
    write_bag(args.output, found.recording, robot, loads=found.loads)
    write_json(truth_file, found.truth)
    summary = {
        "bag": str(args.output),
        "truth_file": str(truth_file),
        "samples": {stream.name: len(stream) for stream in found.recording.streams.values()},
        **not_simulated(robot, found.truth),
        "truth": found.truth,
    }
    if args.json is not None:
        write_json(args.json, summary)
    print(_as_text(summary, robot))
    return 0


def _masses(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise SimulationError(f"--weights {text}: expected kilograms, for example 0,0.5,1") from None


def _as_text(summary: dict[str, Any], robot: Robot) -> str:
    truth = summary["truth"]
    effects = ", ".join(f"{e['effect']}@{e['owner']}" for e in truth["effects"]) or "none"
    samples = ", ".join(f"{name} {count}" for name, count in summary["samples"].items())
    weights = ", ".join(f"{mass:g}" for mass in truth["weights"])
    hung = f"{weights} kg at {truth['at']}" if any(truth["weights"]) else "no weights"
    left = not_simulated_text(summary)
    return (
        f"{summary['bag']}: {len(truth['rests'])} rests of {truth['robot']} in {truth['seconds']:.0f} s, {hung}, seed "
        f"{truth['seed']}\n  effects: {effects}\n  samples: {samples}\n  truth:   {summary['truth_file']}\n"
        + (f"{left}\n" if left else "")
        + f"  next:    jointscope calibrate {robot_argument(robot)} --rests {shlex.quote(summary['bag'])} "
        f"-o {edited_argument(robot, 'calibrated')}"
    )
