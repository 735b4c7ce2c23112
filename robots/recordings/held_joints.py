# SPDX-License-Identifier: BSD-3-Clause
"""What a user should know about the bodies that a recording is computed with: other joints, and odd inertias."""

from __future__ import annotations

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.units import of_slide

SAME = 1e-3  # [rad], [m] a position that the robot file has already


def about_bodies(recording: Recording, robot: Robot) -> list[Notice]:
    """Where other joints are held, if the robot file does not say so, and remarks on inertias.

    Args:
        recording: what was measured.
        robot: as its file has it.
    """
    tree, name = (robot.as_filed or robot.tree), robot.motor_encoder.name
    notices = [Notice(name, "info", 0, remark) for remark in tree.remarks]
    held = tree.posture(recording.posture)
    new = {joint: at for joint, at in held.items() if not abs(tree.locked.get(joint, 0.0) - at) < SAME}
    if new:
        places = ", ".join(f"{at:.4g} {_unit(robot, joint)}" for joint, at in new.items())
        verb = "is" if len(new) == 1 else "are"
        text = f"{', '.join(new)} {verb} not moved: held at {places} as in the recording"
        filed = [f"{joint} at {tree.locked[joint]:.4g} {_unit(robot, joint)}" for joint in new if joint in tree.locked]
        text += f" (the robot file locks {', '.join(filed)})" if filed else ""
        notices.append(Notice(name, "info", len(new), text))
    return notices


def _unit(robot: Robot, joint: str) -> str:
    return of_slide("rad") if robot.tree.is_slide(joint) else "rad"
