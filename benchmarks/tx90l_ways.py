# SPDX-License-Identifier: BSD-3-Clause
"""Drives and bearings of a TX90L simulated elsewhere, from the same recordings in three ways.

The logarithm of the response matrix (Neubauer et al. 2015, eq. 27), the torque balance line by line, which is the
default, and motion in the time domain, with rigid bearings and with soft ones; the fastest mode of the arm is told
beside the sampling of the bags.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from tx90l_motion import motion_row

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.frequency.settled_stages import logarithm_begin
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage
from jointscope.robots.geometry.flexible_arm import FlexibleArm
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.at_poses.read_shaken import read_shaken

Tell = Callable[[str], None]
SECONDS = 2.0  # of a pose as motion
STEP = 1e-3  # [s] from sample to sample of the bags


def ways_rows(robot: Robot, data: Path, tell: Tell) -> dict[str, Any]:
    """Errors of each way.

    Args:
        robot: the TX90L.
        data: folder of the sets.
        tell: takes each line.
    """
    recordings = [read_shaken(data / "frequency" / f"frequency_{pose}", robot) for pose in ("P1", "P3")]
    told = json.loads((data / "frequency" / "truth.json").read_text(encoding="utf-8"))["elasticity"]
    truth = {}
    for j in ("1", "2", "3"):
        for letter, part in (("c", "stiffness"), ("d", "damping")):
            truth[f"joint{j}.{part}"] = told[f"{letter}{j}"]
            truth |= {f"joint{j}.bearing.{part}_{axis}": told[f"{letter}{j}{axis}"] for axis in "xy"}
    problems = [first_stage(robot, ShakenPose.of(*recording)) for recording in recordings]
    _, logarithm, _ = logarithm_begin(problems, [])
    balance = calibrate_frequency(robot, recordings).robot
    ways = {
        "logarithm of the matrix": logarithm.by_name,
        "torque balance, the default": {name: balance.parameters[name].value for name in truth},
    }
    tell("| largest error, made elsewhere, two poses | drives | bearings | dampers of drives |")
    tell("| --- | --- | --- | --- |")
    found: dict[str, Any] = {}
    for way, values in ways.items():
        error = {name: abs(values[name] / true - 1.0) for name, true in truth.items()}
        groups = [_largest(error, ".stiffness"), _largest(error, "bearing.stiffness"), _largest(error, ".damping")]
        tell(f"| {way} | {' | '.join(f'{100.0 * each:.2f} %' for each in groups)} |")
        found[way] = groups
    values, ends = motion_row(robot, data / "frequency" / "frequency_P1", SECONDS)
    found["motion"] = [
        max(abs(values[f"joint{j}.{part}"] / truth[f"joint{j}.{part}"] - 1.0) for j in (1, 2, 3))
        for part in ("stiffness", "damping")
    ]
    drives, dampers = (f"{100.0 * each:.2f} %" for each in found["motion"])
    tell(f"| motion, {SECONDS:g} s of one pose, bearings rigid | {drives} | not in the model | {dampers} |")
    tell(f"\nMotion with `bearing_flexibility` at three joints, from Table 1, {ends}.")
    arm, values = FlexibleArm(robot), {n: p.value for n, p in robot.parameters.items()} | truth
    fastest = max(_fastest(arm, pose.pose.q, values) for pose in problems)
    turn = 2.0 * np.pi * fastest * STEP
    tell(
        f"\nFor motion in the time domain: the fastest mode of motors, drives and bearings is at {fastest:.0f} Hz; "
        f"a step of {1e3 * STEP:g} ms turns its phase by {turn:.1f} rad.\n"
    )
    return {"ways": found, "fastest_hz": fastest}


def _largest(error: Mapping[str, float], part: str) -> float:
    """Of springs of one sort: bearings where `part` says so, else drives."""
    bearings = "bearing" in part
    return max(e for name, e in error.items() if part in name and ("bearing" in name) == bearings)


def _fastest(arm: FlexibleArm, q: Any, values: Mapping[str, float]) -> float:
    """Highest natural frequency with the motors free to turn [Hz]."""
    M, _, G = arm.linearised(q, values).mean
    n, nu = len(M), len(arm.joints)
    E = np.zeros((n, nu))
    E[arm.driven, np.arange(nu)] = 1.0
    k = np.diag([values[spring.stiffness] for spring in arm.springs])
    K = np.block([[k + G, -k @ E], [-(k @ E).T, E.T @ k @ E]])
    inertias = np.diag([values[f"{joint}.inertia"] for joint in arm.joints])
    masses = np.block([[M, np.zeros((n, nu))], [np.zeros((nu, n)), inertias]])
    return float(np.sqrt(np.max(np.linalg.eigvals(np.linalg.solve(masses, K)).real)) / (2.0 * np.pi))
