# SPDX-License-Identifier: BSD-3-Clause
"""Springs that do not deflect in a recording of motion though the links pull at them: they were locked, or far stiffer.

Compared with what the weight of the links alone does to springs of the file's stiffness, both without what goes in a
straight line with angles and speeds: a wrong matrix or late encoders explain nothing away.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.transmission_evidence import stated_matrix
from jointscope.robots.model.command_words import bag_arguments, edited_argument, robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording

Array = NDArray[np.float64]

UNSTRETCHED = "unstretched"  # kind of its notices
INSTANTS, FEWEST = 1500, 200
WITHIN = 2.0  # times what encoders explain, that is no deflection
EXPECTED = 8.0  # times what encoders explain, that weight would stretch springs by


def unstretched_springs(recording: Recording, robot: Robot) -> list[Notice]:
    """Names springs that should deflect, and do not.

    Args:
        recording: of motion.
        robot: with the stiffnesses of its file.
    """
    link = robot.link_encoder
    if link is None or robot.free_links or not robot.layout.n_motor:
        return []
    motors, links = recording.streams[robot.motor_encoder.name], recording.streams[link.name]
    begin, end = max(motors.times[0], links.times[0]), min(motors.times[-1], links.times[-1])
    if min(len(motors), len(links)) < FEWEST or end <= begin:
        return []
    times = np.linspace(begin, end, INSTANTS)
    q_motor, q = (np.column_stack([np.interp(times, s.times, c) for c in s.values.T]) for s in (motors, links))
    if not (np.all(np.isfinite(q)) and np.all(np.isfinite(q_motor))):
        return []
    q = q - link.zero
    T = stated_matrix(robot)
    A = np.linalg.inv(T)
    load = robot.tree.torque(q, 0.0 * q, 0.0 * q) @ T
    explained = np.sqrt(robot.motor_encoder.sigmas**2 + A**2 @ link.sigmas**2)
    straight = np.column_stack([q, np.gradient(q, times, axis=0), np.ones(len(q))])
    found = {}
    for j, joint in enumerate(robot.joints):
        stiffness = robot.values.get(f"{joint}.stiffness")
        if joint not in robot.layout.motors or not stiffness:
            continue
        seen, expected = _rms_beside(straight, np.stack([q @ A[j] - q_motor[:, j], load[:, j] / stiffness], axis=1))
        if seen < WITHIN * explained[j] and expected > EXPECTED * explained[j]:
            found[joint] = seen, expected
    if not found:
        return []
    said = ", ".join(
        f"{joint} (motor and link agree within {seen:.2g} {robot.unit_at(joint, 'rad')}, weight alone would stretch it "
        f"by {expected:.2g} {robot.unit_at(joint, 'rad')})"
        for joint, (seen, expected) in found.items()
    )
    command = (
        f"jointscope calibrate {robot_argument(robot)} --locked-springs {bag_arguments([recording.path])} "
        f"-o {edited_argument(robot, 'coupled')}"
    )
    text = (
        f"springs do not deflect: {said}; if they were locked, this is no recording of motion: {command}; else they "
        "are far stiffer than the robot file says"
    )
    return [Notice(link.name, UNSTRETCHED, len(found), text)]


def _rms_beside(straight: Array, signals: Array) -> Array:
    """Root mean square of what is left of signals, shape (m, k), beside columns of shape (m, c)."""
    left = signals - straight @ np.linalg.lstsq(straight, signals, rcond=None)[0]
    return np.asarray(np.sqrt(np.mean(left**2, axis=0)))
