# SPDX-License-Identifier: BSD-3-Clause
"""Transmission matrices that are transposed, inverse, or of wrong signs or order: what else explains the motion tells.

A matrix is named where it alone leaves clearly less than the file's does, in both halves of the recording.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.transmission_evidence import (
    Moved,
    seen_by_drives,
    seen_by_gyros,
    seen_by_link_encoder,
    stated_matrix,
)
from jointscope.robots.dynamics.transmission import elements
from jointscope.robots.files.sections.transmission_section import WORST_CONDITION
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.motor_zero import with_motor_zero
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

MISTAKEN_TRANSMISSION = "transmission"  # kind of its notices
WINDOWS = (0.06, 0.2)  # [s] in the longer one springs swing less
FEWEST = 100  # samples of a stream


@dataclass(frozen=True)
class Mistake:
    """A matrix that explains a recording clearly better than that of the file.

    Attributes:
        how: what was done to it, in words.
        matrix: as it should be, shape (n, n).
        sensors: that tell.
        left: shares of their motion that the file's matrix and this one leave.
    """

    how: str
    matrix: Array
    sensors: str
    left: tuple[float, float]

    def sentence(self, robot: Robot) -> str:
        """What was seen, and what to write."""
        T, now = self.matrix, stated_matrix(robot)
        assert robot.transmission is not None
        own, _ = elements(robot)
        rows = ", ".join(f"[{', '.join(f'{x:.9g}' for x in row + 0.0)}]" for row in T - now + robot.transmission)
        values = "".join(f", `value: {T[at]:.9g}` of parameters.{name}" for name, at in own.items() if T[at] != now[at])
        before, after = self.left
        much = f"{100.0 * before:.0f} %" if before < 1.0 else "all"
        return (
            f"the transmission matrix seems {self.how}: as it stands the motors' motion leaves {much} of the signal of "
            f"{self.sensors} unexplained, so {100.0 * after:.0f} %; if that is so, write "
            f"`transmission: {{matrix: [{rows}]}}`{values} in {robot_argument(robot)} (joint angles = matrix times "
            "motor angles)"
        )

    def is_calibrated(self, robot: Robot) -> bool:
        """Whether only elements are wrong that a calibration finds."""
        own, _ = elements(robot)
        free = [at for name, at in own.items() if not robot.parameters[name].fixed]
        changed = np.argwhere(~np.isclose(self.matrix, stated_matrix(robot)))
        return all(tuple(at) in free for at in changed.tolist())

    def mended(self, robot: Robot) -> Robot:
        """The robot with this matrix, for other checks."""
        assert robot.transmission is not None
        T, own = self.matrix - stated_matrix(robot) + robot.transmission, elements(robot)[0]
        values = {name: replace(robot.parameters[name], value=float(T[at])) for name, at in own.items()}
        return replace(robot, transmission=T, parameters={**robot.parameters, **values})


def mistaken_transmission(recording: Recording, robot: Robot) -> Mistake | None:
    """What is wrong with the matrix of a robot's file; None where it is right, or the recording does not tell.

    Args:
        recording: what was measured.
        robot: as its file has it.
    """
    if robot.transmission is None or robot.free_links or not _is_complete(recording, robot):
        return None
    recording, robot = with_motor_zero(recording, robot), robot.in_posture(recording.posture)
    tried = list(_tried(robot))
    moves = [moved for window in WINDOWS if (moved := Moved.of(recording, robot, window)) is not None]
    for moved in moves:
        drives = seen_by_drives(moved)
        told = seen_by_link_encoder(moved) or seen_by_gyros(moved) or drives
        found = told.best([matrix for _, matrix in tried], drives)
        if found is not None:
            place, before, after = found
            mistake = Mistake(*tried[place], told.sensors, (before, after))
            return None if mistake.is_calibrated(robot) else mistake
    return None


def _is_complete(recording: Recording, robot: Robot) -> bool:
    """Whether other checks would let its streams pass."""
    streams = list(recording.streams.values())
    known = robot.motor_encoder.zero_known or robot.link_encoder is not None
    return known and all(len(s) >= FEWEST and bool(np.all(np.isfinite(s.values))) for s in streams)


def _tried(robot: Robot) -> Iterator[tuple[str, Array]]:
    """What may be otherwise, the plainest first, as far as the robot could have it."""
    T, seen, joints = stated_matrix(robot), [stated_matrix(robot)], robot.joints
    rigid = [i for i, joint in enumerate(joints) if joint not in robot.layout.motors]
    for how, matrix in _mistakes(T, joints):
        if np.linalg.cond(matrix) > WORST_CONDITION:
            continue
        possible = np.array_equal(matrix[rigid], np.eye(len(T))[rigid])
        if not possible or any(np.allclose(matrix, other) for other in seen):
            continue
        seen.append(matrix)
        yield how, matrix


def _mistakes(T: Array, joints: tuple[str, ...]) -> Iterator[tuple[str, Array]]:
    inverse: Array = np.asarray(np.linalg.inv(T), dtype=np.float64)
    yield "transposed", T.T
    yield "inverse (motor angles of joint angles)", inverse
    yield "inverse and transposed", inverse.T
    for i, j in np.argwhere(T - np.diag(np.diag(T))):
        matrix = T.copy()
        matrix[i, j] *= -1.0
        yield f"to have a wrong sign in row {i + 1}, column {j + 1}", matrix
    signs = [np.diag([-1.0 if k == i else 1.0 for k in range(len(T))]) for i in range(len(T))]
    for i, sign in enumerate(signs):
        yield f"to have a wrong sign in row {i + 1} ({joints[i]})", sign @ T
        yield f"to have a wrong sign in column {i + 1} (motor of {joints[i]})", T @ sign
    for i, j in combinations(range(len(T)), 2):
        order = list(range(len(T)))
        order[i], order[j] = j, i
        yield f"to have rows {i + 1} and {j + 1} exchanged", T[order]
        yield f"to have columns {i + 1} and {j + 1} exchanged", T[:, order]
