# SPDX-License-Identifier: BSD-3-Clause
"""Joints that give way: an encoder on the link says other positions than the one on the motor."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.drive_regression import Links
from jointscope.graphs.starts.motion_cells import MotionCells
from jointscope.graphs.starts.windowed_sums import WIDTHS, windowed_rows
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

SURELY = 10.0  # times the noise of both encoders together
SMOOTH = 0.5  # of what is left, that neighbouring samples differ by at the most; stamps that jitter differ by all of it
EXPLAINED = 0.9  # of the mean square of the links' torque, from which a spring is believed
FEWEST = 20  # windows


class FirstSpring(NamedTuple):
    """Stiffness [N m/rad] and damping [N m s/rad]; the damping is zero or below where it is lost in noise."""

    stiffness: float
    damping: float


def soft_joints(motor: Stream, links: Stream, sigmas: Array) -> NDArray[np.bool_]:
    """Which joints have deflections that are no noise or jitter, and no zero, scale or delay of an encoder, shape (n,).

    Args:
        motor: positions of the motors behind their gears, n columns.
        links: positions of the links, n columns.
        sigmas: noise of both encoders together, shape (n,) [rad or m].
    """
    inside = (motor.times > links.times[0]) & (motor.times < links.times[-1])
    soft = np.zeros(motor.values.shape[1], dtype=bool)
    if np.count_nonzero(inside) < 10:
        return soft
    at = motor.times[inside]
    for j, (q_motor, q_link) in enumerate(zip(motor.values[inside].T, links.values.T, strict=True)):
        difference = q_motor - np.interp(at, links.times, q_link)
        columns = np.column_stack([np.ones_like(at), q_motor, np.gradient(q_motor, at)])
        left = difference - columns @ np.linalg.lstsq(columns, difference)[0]
        size = np.sqrt(np.mean(left**2))
        soft[j] = size > SURELY * sigmas[j] and np.sqrt(0.5 * np.mean(np.diff(left) ** 2)) < SMOOTH * size
    return soft


def giving_joints(tree: RigidTree, motor: Stream, links: Links, sigmas: Array) -> tuple[str, ...]:
    """Joints whose two encoders tell that they give way, and that can have a spring.

    Args:
        tree: the robot.
        motor: positions of the motors behind their gears, n columns.
        links: what the encoders on the links saw.
        sigmas: noise of the motors' encoders, shape (n,) [rad or m].
    """
    soft = soft_joints(motor, links.encoder, np.hypot(sigmas, links.sigmas))
    no_spring = {*tree.slides, *tree.massless}
    return tuple(name for name, gives in zip(tree.joints, soft, strict=True) if gives and name not in no_spring)


def first_springs(motors: MotionCells, links: MotionCells, load: Array) -> list[FirstSpring | None]:
    """The spring of each joint; None where the deflection does not explain the torque.

    Torque of the links against deflection, M a + c + g = K (q_motor - q_link) + D (v_motor - v_link), where all of the
    left side is from the motion of the links: nothing of the drives is in it. One that hardens gets the mean slope.

    Args:
        motors: motion of the motors.
        links: of the links, in the same cells.
        load: torques M a + c + g of the links, shape (m, n) [N m].
    """
    signals = np.stack([load, motors.q - links.q, motors.v - links.v], axis=2)
    best: list[tuple[float, FirstSpring | None]] = [(EXPLAINED, None)] * load.shape[1]
    for width in WIDTHS:
        for j, (rows, _, _) in enumerate(windowed_rows(motors, signals, width)[0]):
            if len(rows) < FEWEST or not rows[:, 0].any():
                continue
            torque, deflection = rows[:, 0], rows[:, 1:]
            spring = np.linalg.lstsq(deflection, torque)[0]
            share = 1.0 - float(np.sum((torque - deflection @ spring) ** 2) / np.sum(torque**2))
            if share > best[j][0] and spring[0] > 0.0:
                best[j] = share, FirstSpring(float(spring[0]), float(spring[1]))
    return [spring for _, spring in best]
