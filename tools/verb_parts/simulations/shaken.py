# SPDX-License-Identifier: BSD-3-Clause
"""`simulate --kind frequency`: a robot that is shaken in some poses; a folder of bags and the truth beside it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.effects_of_file import not_simulated, not_simulated_text
from jointscope.tools.verb_parts.simulation_options import assignments, conditions_of
from jointscope.tools.writing.whole_file import write_json

F0 = {True: 0.25, False: 0.5}  # [Hz] of an arm with a section `frequency`, and of other robots


def add_shaking_options(parser: argparse.ArgumentParser) -> None:
    """Adds --pose, --realisations, --periods, --f0, --highest and --share."""
    group = parser.add_argument_group("recordings of --kind frequency")
    group.add_argument(
        "--pose",
        action="append",
        default=[],
        metavar="Q1,Q2,...",
        help="positions of all joints of a pose in which the robot is shaken [rad]; may be repeated; default: drawn",
    )
    group.add_argument("--realisations", type=int, default=2, metavar="N", help="sets of random phases; default 2")
    group.add_argument("--periods", type=int, default=2, metavar="N", help="that are kept of each; default 2")
    group.add_argument(
        "--f0",
        type=float,
        metavar="HZ",
        help="distance of the lines, of which odd ones are excited; default 0.25, or 0.5 without a section frequency",
    )
    group.add_argument("--highest", type=float, default=100.0, metavar="HZ", help="highest line; default 100")
    group.add_argument(
        "--share",
        type=float,
        metavar="P",
        help="of what each drive can give beside the weight, that shakes at most; default 0.4, and with a section "
        "frequency 0.7 rad/s^2",
    )


def simulate_shaken(robot: Robot, args: argparse.Namespace, truth_file: Path) -> int:
    """Simulates, writes bags, description and truth, and says what was done.

    Raises:
        SimulationError: a file in place of a folder, or a pose that is none.
    """
    from jointscope.tools.simulator.frequency_simulation import SHARE, Shaking

    if args.output.suffix:
        raise SimulationError(f"{args.output}: a bag of each pose goes into a folder; expected a name without ending")
    own = robot.frequency is not None or not robot.motion
    shaking = Shaking(
        poses=[_pose(text) for text in args.pose],
        count=(2 if own else 1) if args.count is None else args.count,
        realisations=args.realisations,
        periods=args.periods,
        f0=F0[own] if args.f0 is None else args.f0,
        highest=args.highest,
        friction=args.friction,
        share=SHARE if args.share is None and robot.frequency is None else args.share,
    )
    bags, lines, truth, hint = (_arm if own else _of_motion)(robot, args, shaking)
    write_json(truth_file, truth)
    if args.json is not None:
        write_json(args.json, {"bags": list(map(str, bags)), "truth_file": str(truth_file), "truth": truth})
    effects = ", ".join(f"{e['effect']}@{e['owner']}" for e in truth["effects"]) or "none"
    print(
        f"{', '.join(map(str, bags))}: {robot.name} shaken at {lines} lines up to {args.highest:g} Hz, seed {args.seed}"
    )
    print(f"  effects: {effects}\n  truth:   {truth_file}{hint}")
    return 0


Written = tuple[list[Path], int, Mapping[str, Any], str]  # bags, number of lines, truth, what else to say


def _arm(robot: Robot, args: argparse.Namespace, shaking: Any) -> Written:
    """An arm whose other joints are locked, with the errors and bearings of its poses."""
    from jointscope.tools.bags.at_poses.write_shaken import write_shaken
    from jointscope.tools.simulator.arm.usual_drives import with_usual_drives
    from jointscope.tools.simulator.frequency_simulation import simulate_frequency
    from jointscope.tools.simulator.pose_simulation import PoseConditions
    from jointscope.tools.terminal.progress import progress_bar

    shaken, made_up = with_usual_drives(robot)
    conditions = PoseConditions(assignments(args.set), args.effect)
    with progress_bar() as progress:
        found, multisine, truth = simulate_frequency(
            shaken, args.seed, conditions, shaking, args.session, lambda share: progress("simulating", share)
        )
    said = _said(multisine, truth["poses"], "N m")
    recordings = [(r.name, r.signals, r.command) for r in found]
    return (
        write_shaken(args.output, shaken, recordings, found[0].excitation, said),
        len(multisine.lines),
        truth,
        made_up,
    )


def _of_motion(robot: Robot, args: argparse.Namespace, shaking: Any) -> Written:
    """A robot with its own drives and sensors, all of whose joints are shaken."""
    from jointscope.tools.bags.at_poses.write_shaken import write_described
    from jointscope.tools.simulator.shaken_motion import simulate_shaken_motion
    from jointscope.tools.terminal.progress import progress_bar

    with progress_bar() as progress:
        runs, multisine, excitation, truth = simulate_shaken_motion(
            robot, args.seed, conditions_of(args), shaking, args.session, lambda share: progress("simulating", share)
        )
    recordings = [(run.name, run.recording) for run in runs]
    said = _said(multisine, truth["poses"], "N m of the motors, in the unit of the joints")
    bags = write_described(args.output, robot, recordings, excitation, said)
    hint = (
        f"\n  responses: jointscope frequency {' '.join(map(str, bags))} --report frf.html"
        f"\n  its values: jointscope calibrate {args.robot} {bags[0]} -o {Path(args.robot).stem}_calibrated.yaml"
        "\n  (as motion; --frequency needs a section `frequency` in the robot file, and torques that were measured)"
    )
    left = not_simulated_text(not_simulated(robot, truth))
    return bags, len(multisine.lines), truth, hint + (f"\n{left}" if left else "")


def _said(multisine: Any, poses: Mapping[str, Any], unit: str) -> str:
    """Amplitudes, phases and poses as lines of excitation.yaml."""
    phases = "".join(f"  - {np.round(each, 6).tolist()}\n" for each in multisine.phases)
    listed = "".join(f"  {name}: {np.round(q, 6).tolist()}\n" for name, q in poses.items())
    amplitude = [float(f"{a:.6g}") for a in multisine.amplitude]
    return f"amplitude: {amplitude}  # [{unit}]\nphases:  # [rad]\n{phases}poses:\n{listed}"


def _pose(text: str) -> NDArray[np.float64]:
    try:
        return np.array([float(part) for part in text.split(",")])
    except ValueError:
        raise SimulationError(f"--pose {text}: expected angles, for example 0.1,0.7,0.6,1.2,1.0,0.3") from None
