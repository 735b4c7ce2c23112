# SPDX-License-Identifier: BSD-3-Clause
"""How much of the torques a regression leaves open: what units, signs and names of joints are judged by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.starts.drive_regression import DriveEquation, Driven, drive_equations
from jointscope.graphs.starts.drive_signal import open_torque
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Stream


def equations_of(tree: RigidTree, encoder: Stream, command: Stream, held: bool) -> list[DriveEquation]:
    """The equation of each joint; none where the recording tells nothing.

    Args:
        tree: the robot, with masses.
        encoder: positions [rad or m].
        command: what drives the joints.
        held: whether a command acts until the next one.
    """
    try:
        return drive_equations(tree, [Driven(encoder, command)], np.zeros(tree.n), held=held)
    except RecordingError:
        return []


def open_share(equations: Sequence[DriveEquation]) -> float:
    """Root mean square share of the torques that is left open; infinite without any equation."""
    shares = [min(open_torque(equation)[1], 1.0) for equation in equations]
    return float(np.sqrt(np.mean(np.square(shares)))) if shares else np.inf
