# SPDX-License-Identifier: BSD-3-Clause
"""Drives and bearings of simulated TX90Ls from frequency responses: errors and sigmas beside what was promised."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.at_poses.read_shaken import read_shaken

WANTED = {"frequency": "1 %, 4 %", "frequency_soft_bearing": "1 %, 5 %"}  # errors of drives, of bearings


def frequency_rows(robot: Robot, data: Path) -> tuple[list[str], dict[str, Any]]:
    """Lines of a table, and the same for machines.

    Args:
        robot: the TX90L.
        data: folder of the sets.
    """
    lines = [
        "| made elsewhere, frequency responses in two poses | wanted | drives, largest error | bearings, largest error "
        "| farthest, in sigmas | not identifiable | CPU s |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    found: dict[str, Any] = {}
    for name, wanted in WANTED.items():
        began = time.process_time()
        recordings = [read_shaken(data / name / f"frequency_{pose}", robot) for pose in ("P1", "P3")]
        result = calibrate_frequency(robot, recordings)
        seconds = time.process_time() - began
        true = json.loads((data / name / "truth.json").read_text(encoding="utf-8"))["elasticity"]
        drives, bearings, sigmas = [], [], []
        for j in ("1", "2", "3"):
            for axis in ("", "x", "y"):
                p = result.robot.parameters[f"joint{j}." + (f"bearing.stiffness_{axis}" if axis else "stiffness")]
                miss = p.value - true[f"c{j}{axis}"]
                (bearings if axis else drives).append(abs(100.0 * miss / true[f"c{j}{axis}"]))
                sigmas.append(abs(miss) / (p.sigma or float("nan")))
        silent = ", ".join(result.silent) or "nothing"
        lines.append(
            f"| {name} | {wanted}, 3 sigma | {max(drives):.2f} % | {max(bearings):.2f} % | {max(sigmas):.1f} "
            f"| {silent} | {seconds:.0f} |"
        )
        found[name] = {"drives": drives, "bearings": bearings, "sigmas": sigmas, "silent": list(result.silent)}
    return lines, {"frequency": found}
