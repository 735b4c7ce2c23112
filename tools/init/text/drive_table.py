# SPDX-License-Identifier: BSD-3-Clause
"""What the regression found about every drive, for the screen and for JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointscope.graphs.starts.drive_regression import IMPOSSIBLE, PLACES, Value
from jointscope.robots.units import joined, of_slide
from jointscope.tools.init.robot_guess import RobotGuess

GAIN_UNIT = {"N m": "1", "A": "N m/A", "V": "N m/V", "duty": "N m"}  # of torque per unit of the command
QUANTITIES = {"gain": "", "inertia": "kg m2", "dry": "N m", "viscous": "N m s/rad"}
HEADS = {"gain": "k", "inertia": "inertia", "dry": "dry friction", "viscous": "viscous friction"}
UNKNOWN, IMPOSSIBLE_CELL = "-", " (!)"
MOST_DECIMALS = 9


def drive_content(guess: RobotGuess) -> dict[str, Any]:
    """For JSON, by joint: values with sigmas and units, null where the recording cannot tell, and what is explained."""
    if guess.free_links:
        return {}
    content: dict[str, Any] = {}
    for joint, drive in zip(guess.roles.joints, guess.drives, strict=True):
        row: dict[str, Any] = {}
        for name in QUANTITIES:
            found = None if drive.unknown_scale else drive.found.get(name)
            unit = _unit(guess, name, joint)
            row[name] = None if found is None else {"value": found.value, "sigma": found.sigma, "unit": unit}
        content[joint] = {**row, "explained": drive.explained, "lost": [n for n in QUANTITIES if drive.is_lost(n)]}
    return content


def drive_table(guess: RobotGuess) -> list[str]:
    """For the screen, the head first; empty where nothing could be regressed."""
    if guess.free_links:
        return []
    joints = guess.roles.joints
    rows = [["joint", *(_head(guess, name) for name in QUANTITIES), "explained"]]
    for joint, drive in zip(joints, guess.drives, strict=True):
        found = {} if drive.unknown_scale else drive.found
        cells = [_cell(found.get(name), name in PLACES) for name in QUANTITIES]
        rows.append([joint, *cells, f"{100.0 * drive.explained:.4g} %"])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    if any(UNKNOWN in row for row in rows):
        lines.append(
            f"{UNKNOWN}: the recording does not determine it; where the robot file has it, it is a guess and says so"
        )
    if any(IMPOSSIBLE_CELL in cell for row in rows for cell in row):
        lines.append(
            f"{IMPOSSIBLE_CELL.strip()}: below zero, which no inertia and no friction can be: not a result; masses, "
            "units, names or stamps are wrong there, or something else acts"
        )
    how = "the links' own encoders" if any(drive.own_links for drive in guess.drives) else "rigid joints"
    return [f"drives by regression with {how}, sigmas from blocks of the recording:", *(f"  {x}" for x in lines)]


def _head(guess: RobotGuess, name: str) -> str:
    return f"{HEADS[name]} [{joined([_unit(guess, name, joint) for joint in guess.roles.joints])}]"


def _unit(guess: RobotGuess, name: str, joint: str) -> str:
    unit = QUANTITIES[name] or GAIN_UNIT[guess.command_unit[0]]
    return of_slide(unit) if joint in guess.slides else unit


def _cell(found: Value | None, positive: bool = False) -> str:
    """A value with as many digits as its sigma leaves; marked where it is below zero beyond doubt and cannot be."""
    if found is None or not 0.0 < found.sigma < np.inf:
        return UNKNOWN
    decimals = int(np.clip(-np.floor(np.log10(found.sigma)), 0, MOST_DECIMALS))
    mark = IMPOSSIBLE_CELL if positive and found.value < -IMPOSSIBLE * found.sigma else ""
    return f"{found.value:.{decimals}f} +- {found.sigma:.{decimals}f}{mark}"
