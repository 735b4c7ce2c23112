# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised of calibrations from poses and frequency responses beside what is measured.

Usage: python benchmarks/bench_tx90l.py [kinds | search | coverage | ways | systems] [--json FILE] [--folder DIR]
[--table]

With `kinds` poses and frequency responses in one graph, with `search` what is found with both, with `coverage` how
often sigmas hold the truth, with `ways` the same recordings in three ways, with `systems` response matrices of a motor
bench and a mirror, in sections of their own; an interrupted search goes on where it stopped. Recordings that another
program simulated lie in ../shared/data; arms with effects are simulated by MuJoCo.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from measured_page import environment, write_section
from real_systems import system_rows
from tx90l_coverage import coverage_rows
from tx90l_frequency import frequency_rows
from tx90l_kinds import kinds_rows
from tx90l_search import search_rows
from tx90l_ways import ways_rows

from jointscope.factors.calibration import Calibration
from jointscope.graphs.joint_kinds.discover_arm import discover_arm
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import contact_distances, tip_errors, without_sag
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

DATA = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "tx90l"
CLEAN = range(10)
FAULTS = (
    "encoder_eccentricity@joint2:cos=2e-4",
    "encoder_eccentricity@joint4:cos=4e-4",
    "joint_elasticity@joint5",
    "joint_elasticity@joint4:compliance=1.2e-4",
    "payload@robot:mass=2",
    "payload@robot:mass=4",
    "tracker_drift@robot:x=2e-4",
    "tracker_drift@robot:z=3e-4",
    "backlash@joint5:half_gap=3e-4",
    "backlash@joint4:half_gap=3e-4",
    "spring_cubic@joint3:stiffness=1e11",
)
TOGETHER = ("joint_elasticity@joint5:compliance=4e-5", "encoder_eccentricity@joint2:cos=1.5e-4", "payload@robot:mass=2")

PAPERS = (  # what leaves the 0.19 and 0.32 mm of the paper: ripple, soft wrist, drives that harden, eccentric encoders
    *(f"gear_ripple@joint{j}:amplitude=8e-5,order={n}" for j, n in ((1, 45), (2, 96), (3, 96))),
    *(f"joint_elasticity@joint{j}:compliance=4e-5" for j in (4, 5, 6)),
    *(f"spring_cubic@joint{j}:stiffness=4e10" for j in (2, 3)),
    *(f"encoder_eccentricity@joint{j}:cos=1e-4,sin=1e-4" for j in (2, 4)),
)
PANDA = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "real" / "panda_sockets"

TOLD: list[str] = []  # what goes into the page, too


def main() -> None:
    parser = argparse.ArgumentParser(prog="python benchmarks/bench_tx90l.py", description=__doc__)
    parser.add_argument("part", nargs="?", choices=list(PARTS), help="measure this alone")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures for machines, too")
    folder = Path(tempfile.gettempdir()) / "jointscope-bench-tx90l"
    parser.add_argument(
        "--folder", type=Path, default=folder, metavar="DIR", help=f"recordings and rows of long parts; {folder}"
    )
    parser.add_argument("--table", action="store_true", help="of long parts: measure nothing, tell what is there")
    arguments = parser.parse_args()
    print(f"# Poses\n\n{environment()}\n")
    robot = load_robot("tx90l")
    found: dict[str, Any] = {}
    if arguments.part is not None:
        found |= PARTS[arguments.part](robot, arguments)
        write_section("\n".join([f"## {TITLES[arguments.part]}", *TOLD]), arguments.part)
        _write(arguments.json, found)
        return
    if DATA.is_dir():
        found |= _made_elsewhere(robot)
        rows, figures = frequency_rows(robot, DATA)
        _tell("\n".join(rows) + "\n")
        found |= figures
    if PANDA.is_dir():
        found |= _real()
    found |= _simulated(robot)
    write_section("\n".join(["## Poses", *TOLD]))
    _write(arguments.json, found)


PARTS: dict[str, Callable[[Robot, argparse.Namespace], dict[str, Any]]] = {
    "kinds": lambda robot, _: kinds_rows(robot, DATA, _tell),
    "search": lambda robot, given: search_rows(robot, given.folder, _tell, not given.table),
    "ways": lambda robot, _: ways_rows(robot, DATA, _tell),
    "systems": lambda robot, _: system_rows(_tell),
    "coverage": lambda robot, given: coverage_rows(robot, given.folder, _tell, not given.table),
}
TITLES = {
    "kinds": "Poses and frequency responses in one graph",
    "search": "Poses and frequency responses together: what is missing",
    "ways": "Frequency responses in three ways",
    "systems": "Response matrices of real systems",
    "coverage": "Frequency responses alone: twenty arms",
}


def _write(path: Path | None, found: dict[str, Any]) -> None:
    if path:
        path.write_text(json.dumps(found, indent=1), encoding="utf-8")


def _tell(text: str) -> None:
    """Prints, and keeps it for the page."""
    print(text, flush=True)
    TOLD.append(text)


def _made_elsewhere(robot: Robot) -> dict[str, Any]:
    calibration, verification = (read_poses(DATA / f"poses_{name}", robot) for name in ("calibration", "verification"))
    result, began = calibrate_poses(robot, [calibration]), time.perf_counter()
    calibrate_poses(robot, [verification])
    seconds = time.perf_counter() - began
    whole = _tip(result.robot, verification)
    rigid = _tip(calibrate_poses(without_sag(robot), [calibration]).robot, verification)
    gap = calibrate_poses(robot, [read_poses(DATA / "poses_backlash", robot)]).robot.parameters["joint3.backlash"]
    _tell("| made elsewhere | wanted | measured |\n| --- | --- | --- |")
    _tell(
        f"| 150 poses not fitted: 90 % / largest | 0.055 / 0.11 mm | {whole['p90_mm']:.3f} / {whole['max_mm']:.3f} mm |"
    )
    _tell(f"| the same, rigid | 0.44 / 0.77 mm | {rigid['p90_mm']:.2f} / {rigid['max_mm']:.2f} mm |")
    told = result.determined
    _tell(f"| rank, combinations | 29, 18 | {told.rank}, {len(told.combinations)} |")
    _tell(f"| backlash | -200 +- 15 urad | {1e6 * gap.value:.0f} +- {1e6 * (gap.sigma or 0.0):.0f} urad |")
    _tell(f"| 150 poses | 2 s | {seconds:.2f} s |\n")
    return {"verification": whole, "rigid": rigid, "rank": told.rank, "backlash": gap.value, "seconds_150": seconds}


def _real() -> dict[str, Any]:
    """Panda arms, whole places held out: mean error at poses that were not fitted, and distance of their sockets."""
    _tell("| real arm, place held out | error [mm] | of its sockets, 50 mm | without sag [mm] |")
    _tell("| --- | --- | --- | --- |")
    robot, found = load_robot("panda"), {}
    for name in ("panda_1", "panda_2", "panda_3"):
        poses = read_poses(PANDA / f"{name}.csv", robot)
        for place in dict.fromkeys(poses.groups):
            held = np.array([group == place for group in poses.groups])
            rows = []
            for model in (robot, without_sag(robot)):
                result = calibrate_poses(model, [poses.only(~held)]).robot
                problem = PoseSet(result, poses.only(held), np.eye(4))
                calibration = problem.start(Calibration.of(result))[1]
                apart = contact_distances(problem, calibration)[place]
                rows.append((tip_errors(problem).to_json()["mean_mm"], 1e3 * apart))
            found[f"{name}/{place}"] = rows
            (whole, apart), (rigid, _) = rows
            _tell(f"| {name}, {place} | {whole:.3f} | {apart:.2f} | {rigid:.3f} |")
    _tell("")
    return {"panda": found}


def _simulated(robot: Robot) -> dict[str, Any]:
    _tell("| simulated, 40 poses | found | held out, 90 % before / after [mm] | s |\n| --- | --- | --- | --- |")
    rows, false, first = [], 0, 0
    for seed in CLEAN:
        row = _row(robot, seed, ())
        false += bool(row["found"])
        rows.append(row)
    for i, fault in enumerate(FAULTS):
        row = _row(robot, 20 + i, (fault,))
        first += row["found"][:1] == [fault.partition(":")[0]]
        rows.append(row)
    together = _row(robot, 50, TOGETHER)
    papers = [_row(robot, 60, PAPERS, count) for count in (40, 80)]
    exact, truth = simulate_poses(robot, 150, 60, session="held out")
    floor = _tip(robot.with_values(truth["parameters"]), exact)["p90_mm"]
    for row in papers:
        _tell(
            f"\n{row['count']} poses, held out, over the floor of {floor:.3f} mm (wanted 1.3 or less): "
            f"{row['p90_mm'][-1] / floor:.2f}"
        )
    _tell(f"\nclean arms with a false effect: {false} of {len(CLEAN)}; faults named first: {first} of {len(FAULTS)}")
    return {"rows": [*rows, together, *papers], "floor_mm": floor, "false": false, "first": first}


def _row(robot: Robot, seed: int, effects: tuple[str, ...], count: int = 40) -> dict[str, Any]:
    conditions = PoseConditions(effects=effects)
    train, _ = simulate_poses(robot, count, seed, conditions)
    held, _ = simulate_poses(robot, 150, seed, conditions, session="held out")
    began = time.perf_counter()
    found = discover_arm(robot, [train], [held])
    seconds = time.perf_counter() - began
    p90 = [step.heldout.to_json()["p90_mm"] for step in found.steps if step.heldout is not None]
    names = [step.added.hypothesis.label for step in found.steps if step.added is not None]
    hidden = ", ".join(effects) or f"nothing (seed {seed})"
    _tell(f"| {hidden} | {', '.join(names) or 'nothing'} | {p90[0]:.3f} / {p90[-1]:.3f} | {seconds:.1f} |")
    return {"hidden": list(effects), "seed": seed, "count": count, "found": names, "p90_mm": p90, "seconds": seconds}


def _tip(robot: Robot, poses: Poses) -> dict[str, float]:
    assert robot.poses is not None
    tracker = np.eye(4) if robot.poses.tracker is None else robot.poses.tracker
    return tip_errors(PoseSet(robot, poses, tracker)).to_json()


if __name__ == "__main__":
    main()
