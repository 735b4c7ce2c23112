# SPDX-License-Identifier: BSD-3-Clause
"""How often sigmas of drives, bearings and dampers from frequency responses hold the truth, over twenty TX90Ls.

MuJoCo shakes each arm in two poses that are drawn, two realisations each; every arm has values and geometric errors of
its own. Of intervals of two sigmas 95 % shall hold the truth. An interrupted run goes on where it stopped.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from kept_rows import keep
from tx90l_search import Case, kept, rows_in

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.arm.arm_bodies import true_values

Tell = Callable[[str], None]
SEEDS = range(400, 420)
KINDS = {
    "stiffness of drives": [f"joint{j}.stiffness" for j in (1, 2, 3)],
    "stiffness of bearings": [f"joint{j}.bearing.stiffness_{axis}" for j in (1, 2, 3) for axis in "xy"],
    "damping of drives": [f"joint{j}.damping" for j in (1, 2, 3)],
    "damping of bearings": [f"joint{j}.bearing.damping_{axis}" for j in (1, 2, 3) for axis in "xy"],
}
WANTED = {"stiffness of drives": "90 to 98 %"}


def coverage_rows(robot: Robot, folder: Path, tell: Tell, measure: bool = True) -> dict[str, Any]:
    """Measures the arms, and tells how many values lie within two sigmas of the truth.

    Args:
        robot: the TX90L.
        folder: of recordings, and of the rows that earlier runs of this code measured.
        tell: takes each line.
        measure: whether arms that are missing are measured; else the table is of what is there.
    """
    results, now, known = rows_in(folder, "coverage")
    for seed in SEEDS:
        if f"seed {seed}" not in known and measure:
            row = _row(robot, seed, folder)
            keep(results, now, row)
            known[row["name"]] = row
            print(row["name"], {name: round(away, 1) for name, away in row["away"].items() if "stiffness" in name})
    rows = [known[f"seed {seed}"] for seed in SEEDS if f"seed {seed}" in known]
    tell(f"| {len(rows)} arms | wanted | within 2 sigma | mean square, in sigmas | farthest | median error |")
    tell("| --- | --- | --- | --- | --- | --- |")
    found = {kind: _told(rows, kind, tell) for kind in KINDS}
    unsettled = [row["name"] for row in rows if not row["settled"]]
    tell(f"\narms whose stages did not come to rest: {', '.join(unsettled) or 'none'}")
    tell(f"CPU time of an arm: {np.median([row['seconds'] for row in rows]):.0f} s (median)\n")
    return {"coverage": found, "rows": rows}


def _row(robot: Robot, seed: int, folder: Path) -> dict[str, Any]:
    _, recordings = kept(robot, Case(seed, f"nothing (seed {seed})"), folder)
    truth, began = true_values(robot, seed, {}), time.process_time()
    result = calibrate_frequency(robot, recordings)
    seconds, found = time.process_time() - began, result.robot.parameters
    names = [name for names in KINDS.values() for name in names if name in result.told]
    return {
        "name": f"seed {seed}",
        "away": {n: (found[n].value - truth[n]) / (found[n].sigma or float("nan")) for n in names},
        "error": {n: found[n].value / truth[n] - 1.0 for n in names},
        "settled": result.settled,
        "seconds": seconds,
    }


def _told(rows: Sequence[dict[str, Any]], kind: str, tell: Tell) -> dict[str, float]:
    """One kind of values: those that the responses tell count."""
    away = np.array([row["away"][name] for row in rows for name in KINDS[kind] if name in row["away"]])
    error = np.array([row["error"][name] for row in rows for name in KINDS[kind] if name in row["error"]])
    inside, most = int(np.sum(np.abs(away) < 2.0)), float(np.abs(away).max())
    share, square = inside / len(away), float(np.mean(away**2))
    held, middle = f"{inside} of {len(away)}, {100.0 * share:.0f} %", 100.0 * np.median(np.abs(error))
    tell(f"| {kind} | {WANTED.get(kind, '-')} | {held} | {square:.2f} | {most:.1f} | {middle:.2f} % |")
    return {"inside": share, "mean_square": square, "farthest": most}
