# SPDX-License-Identifier: BSD-3-Clause
"""`simulate --kind frequency`: an arm that is shaken in some poses; a folder of bags and the truth beside it."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.verb_parts.simulation_options import assignments
from jointscope.tools.writing.whole_file import write_json


def add_shaking_options(parser: argparse.ArgumentParser) -> None:
    """Adds --pose, --realisations and --highest."""
    group = parser.add_argument_group("recordings of --kind frequency")
    group.add_argument(
        "--pose",
        action="append",
        default=[],
        metavar="Q1,Q2,...",
        help="angles of all joints [rad] of a pose in which the arm is shaken; may be repeated; default: drawn",
    )
    group.add_argument("--realisations", type=int, default=2, metavar="N", help="sets of random phases; default 2")
    group.add_argument("--highest", type=float, default=100.0, metavar="HZ", help="highest line; default 100")


def simulate_shaken(robot: Robot, args: argparse.Namespace, truth_file: Path) -> int:
    """Simulates, writes bags, description and truth, and says what was done.

    Raises:
        SimulationError: a file in place of a folder, or a pose that is none.
    """
    from jointscope.tools.bags.at_poses.write_shaken import write_shaken
    from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
    from jointscope.tools.simulator.pose_simulation import PoseConditions
    from jointscope.tools.terminal.progress import progress_bar

    if args.output.suffix:
        raise SimulationError(f"{args.output}: a bag of each pose goes into a folder; expected a name without ending")
    shaking = Shaking(
        poses=[_pose(text) for text in args.pose],
        count=2 if args.count is None else args.count,
        realisations=args.realisations,
        highest=args.highest,
        friction=args.friction,
    )
    conditions = PoseConditions(assignments(args.set), args.effect)
    with progress_bar() as progress:
        found, multisine, truth = simulate_frequency(
            robot, args.seed, conditions, shaking, args.session, lambda share: progress("simulating", share)
        )
    phases = "".join(f"  - {np.round(each, 6).tolist()}\n" for each in multisine.phases)
    poses = "".join(f"  {name}: {np.round(q, 6).tolist()}\n" for name, q in truth["poses"].items())
    said = f"amplitude: {np.round(multisine.amplitude, 6).tolist()}  # [N m]\nphases:  # [rad]\n{phases}poses:\n{poses}"
    bags = write_shaken(args.output, robot, [(r.name, r.signals, r.command) for r in found], found[0].excitation, said)
    write_json(truth_file, truth)
    if args.json is not None:
        write_json(args.json, {"bags": list(map(str, bags)), "truth_file": str(truth_file), "truth": truth})
    effects = ", ".join(f"{e['effect']}@{e['owner']}" for e in truth["effects"]) or "none"
    lines = len(multisine.lines)
    print(
        f"{', '.join(map(str, bags))}: {robot.name} shaken at {lines} lines up to {args.highest:g} Hz, seed {args.seed}"
    )
    print(f"  effects: {effects}\n  truth:   {truth_file}")
    return 0


def _pose(text: str) -> NDArray[np.float64]:
    try:
        return np.array([float(part) for part in text.split(",")])
    except ValueError:
        raise SimulationError(f"--pose {text}: expected angles, for example 0.1,0.7,0.6,1.2,1.0,0.3") from None
