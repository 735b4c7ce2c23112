# SPDX-License-Identifier: BSD-3-Clause
"""What recordings are not of one robot that the model can be: drives that saturate, two loads, too few samples."""

from __future__ import annotations

import shlex

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.tools.presentation.left_out import recording_arguments
from jointscope.tools.presentation.numbers import significant

RARE = 0.05  # [s] between samples: a drive's controller is ten times as fast, and what it did between them is not known


def given(result: CalibrationResult) -> list[tuple[str, str]]:
    """Names of checks that fail, with a sentence each; what they say comes before all that steps with effects say."""
    found = []
    if result.saturated:
        found.append(("Drives that give what is commanded", result.saturated))
    if result.changed is not None:
        found.append(("One load throughout", _two_loads(result)))
    if rare := rare_samples(result):
        found.append(("Samples often enough", rare))
    return found


def rare_samples(result: CalibrationResult) -> str:
    """A sentence where samples are rare and the model seems to be wrong: commands between them look like masses."""
    periods = [float(np.median(np.diff(bag.recording.command.times))) for bag in result.bags if bag.recording.streams]
    period = max(periods, default=0.0)
    asked = any(mass.moved(result.found) for mass in result.masses) or any(
        e.moved(result.found) for e in result.lacking
    )
    if period < RARE or not asked:
        return ""
    return (
        f"There are {significant(1.0 / period, 2)} samples a second, and the equations do not hold with them: where a "
        "drive gets more commands than are recorded, what it did between two samples looks like wrong masses and "
        "inertias. Record every command and position, 100 a second or more; only if each command did act until the "
        "next one, it is the model that is wrong: "
        f"`jointscope diagnose {robot_argument(result.start)} {_bags(result)}`."
    )


def _two_loads(result: CalibrationResult) -> str:
    """A sentence with the commands for both parts; empty where the load stays."""
    changed = result.changed
    if changed is None:
        return ""
    begin = f"jointscope calibrate {robot_argument(result.start)} {_bags(result)} -o"
    parts = {"before": (changed.time, changed.end), "after": (0.0, changed.time)}
    commands = [
        f"`{begin} {edited_argument(result.start, part)} --leave-out "
        f"{shlex.quote(f'{changed.path}:{t0:.2f}:{t1:.2f}')}`"
        for part, (t0, t1) in parts.items()
    ]
    return (
        f"From {changed.time:.2f} s of {changed.path} on the arm carries something else than before, as if a payload "
        f"were taken up or set down: at {changed.joint} {significant(100.0 * changed.size, 2)} % of the drive's torque."
        f" Calibrate the part alone whose load {result.robot.tree.urdf.name} has, before with {commands[0]}, or after "
        f"with {commands[1]}."
    )


def _bags(result: CalibrationResult) -> str:
    return recording_arguments([bag.recording for bag in result.bags])
