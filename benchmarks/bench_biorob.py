# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised of the BioRob beside what is measured, on recordings that another program simulated.

Usage: python benchmarks/bench_biorob.py [clean | faults ...]; the recordings lie in ../shared/data/biorob.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from section_runs import run_sections
from tables import Section, Table

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.discovery.discover import discover
from jointscope.graphs.refits.validation import heldout_error
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording

DATA = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "biorob"
FAULTS = {  # folder: what its README says is wrong, as candidates are labelled
    "deadzone": ("backlash@joint1",),
    "idler": ("kinematic_coupling@joint4", "kinematic_coupling@joint3"),
    "hall": ("encoder_eccentricity@joint3.link",),
}
SECTIONS = ("clean", "faults")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python benchmarks/bench_biorob.py", description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help="; ".join(SECTIONS))
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures for machines, too")
    arguments = parser.parse_args()
    robot, measure = load_robot("biorob"), {"clean": _clean, "faults": _faults}
    names = arguments.sections or SECTIONS
    run_sections("BioRob", names, lambda name: measure[name](robot), False, arguments.json)


def _clean(robot: Robot) -> Section:
    """A calibration of the arm with nothing wrong, against the truth that its recording came with."""
    train, test = _pair(robot, "clean")
    cpu, wall = time.process_time(), time.perf_counter()
    result = calibrate(robot, [train])
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    wanted = _truth(json.loads((DATA / "clean" / "truth.json").read_text(encoding="utf-8"))["train"]["true"])
    found = result.robot.parameters
    off = {name: (found[name].value - value) / (found[name].sigma or np.nan) for name, value in wanted.items()}
    worst = max(off, key=lambda name: abs(off[name]))
    percent = {name: 100.0 * abs(found[name].value / value - 1.0) for name, value in wanted.items()}
    furthest = max(percent, key=lambda name: percent[name])
    rows = [
        ("20 s calibrated [CPU s; wall s]", "", f"{cpu:.0f}; {wall:.0f}"),
        ("parameter furthest from the truth", "3 sigma", f"{worst}: {off[worst]:+.1f} sigma"),
        ("the same, relative", "", f"{furthest}: {percent[furthest]:.2g} %"),
        ("held out, 0.1 s ahead", "", f"{heldout_error(result.robot, test):.2f} sigma"),
    ]
    table = Table("clean", ("what", "wanted", "measured"), rows)
    return Section("BioRob, nothing wrong", "Calibrated with `train`, judged on `test`.", tables=[table])


def _faults(robot: Robot) -> Section:
    """Discovery on the recordings with a fault, from the model that does not know it."""
    rows = []
    for folder, names in FAULTS.items():
        train, test = _pair(robot, folder)
        cpu, wall = time.process_time(), time.perf_counter()
        result = discover(robot, [train], test, missing_torque=False)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        added = [step.added for step in result.steps if step.added is not None]
        errors = [result.steps[0].heldout_error, result.steps[-1].heldout_error]
        right = "yes" if added[:1] and added[0] in names else "no"
        told = ", ".join(added) or "nothing"
        rows.append(
            (folder, " or ".join(names), told, right, f"{errors[0]:.1f} / {errors[1]:.1f}", f"{cpu:.0f}; {wall:.0f}")
        )
    head = ("recording", "hidden", "found", "first", "held out, before / after [sigma]", "CPU s; wall s (90)")
    return Section("BioRob, hidden faults", "The model does not know the fault.", tables=[Table("faults", head, rows)])


def _pair(robot: Robot, folder: str) -> tuple[Recording, Recording]:
    """Recordings to learn from and to judge by."""
    paths = [next(iter(sorted((DATA / folder).glob(f"{name}*")))) for name in ("train", "test")]
    return read_recording(paths[0], robot), read_recording(paths[1], robot)


def _truth(true: dict[str, Any]) -> dict[str, float]:
    """What can be compared by name: friction, rotors, total damping of the motors, damping of the links."""
    found = {}
    for i in range(4):
        joint, friction = f"joint{i + 1}", true["friction_Nm_powers_0_1_2_of_abs_load"][i]
        found[f"{joint}.coulomb_torque"] = friction[0]
        found[f"{joint}.weight_dependent_friction.coefficient"] = friction[1]
        found[f"{joint}.weight_dependent_friction.quadratic"] = friction[2]
        found[f"{joint}.inertia"] = true["motor_inertia_pulley_kgm2"][i]
        back, own = (true[f"{name}_pulley_Nms_per_rad"][i] for name in ("back_emf_damping", "motor_viscous"))
        found[f"{joint}.k_mi"] = back + own
        found[f"{joint}.link_viscous.coefficient"] = true["link_damping_Nms_per_rad"][i]
    return found


if __name__ == "__main__":
    main()
