# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised of the BioRob beside what is measured, on recordings that another program simulated.

Usage: python benchmarks/bench_biorob.py [rests | together | arms | faults | clean | currents | lag | hebi
| nothing | deadzone | idler | hall ...]; the recordings lie in ../shared/data, those of `arms` and `faults` are
simulated.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
from biorob_arms import coverage
from biorob_currents import currents
from biorob_faults import faults
from biorob_hebi import hebi
from biorob_lag import lag
from biorob_rests import rests_alone, together, true_drives
from section_runs import run_sections
from tables import Section, Table

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.discovery.discover import discover
from jointscope.graphs.refits.validation import heldout_error
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording

DATA = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "biorob"
FAULTS = {  # folder: what its README says is wrong, as candidates are labelled
    "deadzone": "backlash@joint1",
    "idler": "kinematic_coupling@joint4",
    "hall": "encoder_eccentricity@joint3.link",
}
IDLER = ", over: {joint3: 0.0120}"  # what a description without the idler lacks
SECTIONS = ("rests", "together", "arms", "faults", "clean", "currents", "lag", "hebi", "nothing", *FAULTS)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python benchmarks/bench_biorob.py", description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help="; ".join(SECTIONS))
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures for machines, too")
    arguments = parser.parse_args()
    names = arguments.sections or SECTIONS
    run_sections("BioRob", names, _section, False, arguments.json)


def _section(name: str) -> Section:
    """One section by its name."""
    if name in ("rests", "together"):
        return (rests_alone if name == "rests" else together)(DATA)
    if name == "arms":
        return coverage()
    if name == "faults":
        return faults()
    if name == "hebi":
        return hebi(DATA.parent / "real")
    if name in ("currents", "lag"):
        return (currents if name == "currents" else lag)(DATA)
    robot = load_robot("biorob")
    if name == "clean":
        return _clean(robot)
    return _searched(robot, "clean", None) if name == "nothing" else _searched(_blind(name), name, FAULTS[name])


def _clean(robot: Robot) -> Section:
    """A calibration of the arm with nothing wrong, against the truth that its recording came with."""
    train, test = _pair(robot, "clean")
    cpu, wall = time.process_time(), time.perf_counter()
    result = calibrate(robot, [train])
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    wanted = true_drives(json.loads((DATA / "clean" / "truth.json").read_text(encoding="utf-8"))["train"]["true"])
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


def _searched(robot: Robot, folder: str, hidden: str | None) -> Section:
    """Discovery on a recording, from a model that does not know what is wrong."""
    train, test = _pair(robot, folder)
    cpu, wall = time.process_time(), time.perf_counter()
    result = discover(robot, [train], test, missing_torque=False)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    added = [step.added for step in result.steps if step.added is not None]
    last = result.steps[-1].robot.parameters
    own = [] if hidden is None else [n for n in last if n.startswith("{1}.{0}.".format(*hidden.split("@")))]
    rows = [
        ("added, in this order", hidden or "nothing", ", ".join(added) or "nothing"),
        *((name, "", f"{last[name].value:.4g} +- {last[name].sigma or np.nan:.2g}") for name in own),
        ("held out before", "", f"{result.steps[0].heldout_error:.2f} sigma"),
        *(
            (f"held out with {step.added or 'one less'}", "", f"{step.heldout_error:.2f} sigma")
            for step in result.steps[1:]
        ),
        ("one process [CPU s; wall s]", "90", f"{cpu:.0f}; {wall:.0f}"),
    ]
    title = "BioRob, nothing to find" if hidden is None else f"BioRob, hidden: {folder}"
    return Section(title, "The model does not know it.", tables=[Table(folder, ("what", "wanted", "found"), rows)])


def _blind(folder: str) -> Robot:
    """The description that lacks what a recording hides; the ready robot knows the idler."""
    if folder != "idler":
        return load_robot("biorob")
    text = ready_robots()["biorob"].read_text(encoding="utf-8")
    assert IDLER in text
    with tempfile.TemporaryDirectory() as folder_of_file:
        path = Path(folder_of_file) / "biorob.yaml"
        text = text.replace(IDLER, "").replace("urdf: biorob.urdf ", "urdf: ready:biorob/biorob.urdf ")
        path.write_text(text, encoding="utf-8")
        return load_robot(str(path))


def _pair(robot: Robot, folder: str) -> tuple[Recording, Recording]:
    """Recordings to learn from and to judge by."""
    paths = [next(iter(sorted((DATA / folder).glob(f"{name}*")))) for name in ("train", "test")]
    return read_recording(paths[0], robot), read_recording(paths[1], robot)


if __name__ == "__main__":
    main()
