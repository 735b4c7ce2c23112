# SPDX-License-Identifier: BSD-3-Clause
"""Poses and frequency responses of TX90Ls in one graph: the tip, and sigmas beside those of one kind."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.joint_kinds.calibrate_kinds import calibrate_kinds
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.graphs.poses.tracker_start import placed
from jointscope.robots.geometry.error_parameters import BEARING, STIFFNESS
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.bags.at_poses.read_shaken import read_shaken

Tell = Callable[[str], None]


def kinds_rows(robot: Robot, data: Path, tell: Tell) -> dict[str, Any]:
    """The joint estimate of the recordings made elsewhere.

    Args:
        robot: the TX90L.
        data: folder of the sets.
        tell: takes each line.
    """
    shaken = {name: read_shaken(data / "frequency" / f"frequency_{name}", robot) for name in ("P1", "P3")}
    poses, verification = (read_poses(data / f"poses_{name}", robot) for name in ("calibration", "verification"))
    alone, found = calibrate_poses(robot, [poses]), {}
    tell("| poses and frequency responses made elsewhere | wanted | 90 % [mm] | largest [mm] | s |")
    tell("| --- | --- | --- | --- | --- |")
    for label, names in (("P1 and P3", ("P1", "P3")), ("P1 alone, a poor set", ("P1",))):
        began = time.perf_counter()
        both = calibrate_kinds(robot, [shaken[name] for name in names], [poses])
        seconds = time.perf_counter() - began
        _row(tell, found, f"one graph, {label}", "0.055, 0.11", _tip(both.robot, verification), seconds)
        held = calibrate_frequency(robot, [shaken[name] for name in names])
        two = calibrate_poses(_stiffnesses_held(held.robot, robot), [poses])
        _row(tell, found, f"two stages, {label}", "-", _tip(two.robot, verification), None)
        names_of = [f"joint{j}.{part}" for j in (1, 2, 3) for part in (STIFFNESS, *BEARING)]
        grown = {n: _sigma(both, n) / min(_sigma(held, n), _sigma(alone, n)) for n in names_of}
        worst = max(grown, key=lambda n: grown[n])
        tell(f"| {label}: largest sigma over that of the better kind alone | 1 | {grown[worst]:.3f} ({worst}) | | |")
        found[f"sigmas, {label}"] = grown
    _row(tell, found, "poses alone", "-", _tip(alone.robot, verification), None)
    tell("")
    return {"kinds": found}


def _stiffnesses_held(found: Robot, robot: Robot) -> Robot:
    """The robot with stiffnesses that another stage found, which this one may not change."""
    ends = (f".{STIFFNESS}", *BEARING)
    parameters = {
        n: replace(p, value=found.parameters[n].value, fixed=True) if n.endswith(ends) else p
        for n, p in robot.parameters.items()
    }
    return replace(robot, parameters=parameters)


def _row(tell: Tell, found: dict[str, Any], label: str, wanted: str, mm: dict[str, float], s: float | None) -> None:
    seconds = "" if s is None else f"{s:.0f}"
    tell(f"| {label} | {wanted} | {mm['p90_mm']:.4f} | {mm['max_mm']:.3f} | {seconds} |")
    found[label] = mm


def _sigma(result: Any, name: str) -> float:
    """Of a logarithm."""
    p = result.robot.parameters[name]
    return float((p.sigma or np.inf) / p.value)


def _tip(robot: Robot, poses: Any) -> dict[str, float]:
    return tip_errors(placed(robot, [poses])[1][0]).to_json()
