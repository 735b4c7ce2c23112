# SPDX-License-Identifier: BSD-3-Clause
"""Whether a drive signal acts until its next sample, as a command does, or was measured and runs on between samples.

Both ways are tried in the regression of the drives; the wrong one leaves several times the torque unexplained, as it
puts the signal half a sample off and makes steps of what is smooth, or the other way round. Where the motion does not
tell, the place does: a signal beside the positions, in the same messages, was measured with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.drive_regression import GAIN, DriveEquation, Driven, drive_equations
from jointscope.graphs.starts.drive_starts import driven_joints
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording

Array = NDArray[np.float64]

CLEARLY = 1.5  # times the missing torque, mean over the joints, that the wrong way leaves
EXPLAINED = 0.1  # of the driving torque that may be missing where that is believed
MEASURED = (
    "the drive signal comes with the positions on {}, so it is taken for measured: it runs on between its samples; "
    "`held: true` in the section command makes it a command that acts until the next one"
)
TOLD_HELD = "the motion says that each value on {} acts until the next one, as a command does: `held: true`"
TOLD_MEASURED = "the motion says that the drive signal on {} was measured, and runs on between samples: `held: false`"


def with_known_drive_signal(robot: Robot, recordings: Sequence[Recording]) -> Robot:
    """The robot with `held` settled for its drive signal; as it was where the file says it, or nothing tells.

    Args:
        robot: the model.
        recordings: of it.
    """
    own_motors = set(robot.layout.motors)
    if robot.command.held is not None or own_motors or robot.free_links or not recordings:
        return robot
    tree = robot.in_posture(recordings[0].posture).tree
    told = acts_until_the_next(
        tree, driven_joints(robot, recordings), robot.motor_encoder.sigmas, robot.friction_sharpness()
    )
    if told is None or told == robot.command_held:
        return robot
    return replace(robot, command=replace(robot.command, held=told))


def told_drive_signal(robot: Robot, recordings: Sequence[Recording]) -> tuple[Robot, list[Notice]]:
    """The same with a sentence about it where it is not plain."""
    known = with_known_drive_signal(robot, recordings)
    if known.command.held is not robot.command.held:
        text = (TOLD_HELD if known.command.held else TOLD_MEASURED).format(robot.command.topic)
    elif robot.command.held is None and not robot.command_held:
        text = MEASURED.format(robot.command.topic)
    else:
        return known, []
    return known, [Notice("command", "info", 0, text)]


def acts_until_the_next(
    tree: RigidTree, recordings: Sequence[Driven], sigmas: Array, sharpness: float | Array = 1e4
) -> bool | None:
    """Whether the motion says that a drive signal is held; None where it does not tell.

    Args:
        tree: rigid bodies with masses.
        recordings: what drove the joints, and how they moved.
        sigmas: noise of the encoders, shape (n,) [rad].
        sharpness: k in tanh(k v), which stands for sign(v), of all joints or of each, shape (n,) [s/rad].
    """
    held, linear = (
        [open_torque(equation) for equation in drive_equations(tree, recordings, sigmas, held=way, sharpness=sharpness)]
        for way in (True, False)
    )
    ratios = [a[0] / b[0] for a, b in zip(held, linear, strict=True) if min(a[1], b[1]) < EXPLAINED and b[0] > 0 < a[0]]
    if not ratios:
        return None
    ratio = float(np.exp(np.mean(np.log(ratios))))
    return True if ratio < 1.0 / CLEARLY else False if ratio > CLEARLY else None


def open_torque(equation: DriveEquation) -> tuple[float, float]:
    """Torque that an equation leaves [N m], and its share of what drives the joint."""
    values = equation.solve()
    given = {} if GAIN in values else {GAIN: 1.0}
    found = given | {law: value.value for law, value in (equation.solve(given) if given else values).items()}
    missing, driving = equation.missing(found), equation.torque(abs(found[GAIN]))
    return missing, missing / driving if driving > 0.0 else np.inf
