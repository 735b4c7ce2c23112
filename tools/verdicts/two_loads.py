# SPDX-License-Identifier: BSD-3-Clause
"""A load that is taken up or set down in the middle of a recording: each part is a recording of its own."""

from __future__ import annotations

import shlex

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.files.robot_file import edited_argument, robot_argument
from jointscope.tools.presentation.numbers import significant


def two_loads(result: CalibrationResult) -> str:
    """A sentence with the commands for both parts; empty where the load stays."""
    changed = result.changed
    if changed is None:
        return ""
    bags = " ".join(shlex.quote(bag.recording.path) for bag in result.bags)
    begin = f"jointscope calibrate {robot_argument(result.start)} {bags} -o"
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
