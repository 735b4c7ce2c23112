# SPDX-License-Identifier: BSD-3-Clause
"""Where the joints stand that a robot file does not model, as far as the encoders' messages name them.

Joints of the URDF that stay where they are carry weight and turn axes: the bodies must stand as they stood. A joint
that moves without being modelled makes every result wrong, so it is an error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recording import Notice
from jointscope.robots.robot import Robot
from jointscope.robots.units import si_factor, si_unit
from jointscope.tools.bags.message_parts import MessageParts

STILL = {"rad": 0.03, "m": 0.005}  # a joint that spans less is held; its weight then moves as little
OUTLYING = 0.005  # share of the samples on either side that does not count: glitches, foreign messages
NOTICEABLE = {"rad": 0.01, "m": 0.002}  # difference from the robot file that is said
FEWEST = 10  # samples


def held_posture(found: Sequence[MessageParts], robot: Robot, bag: str) -> tuple[dict[str, float], list[Notice]]:
    """Positions of the joints outside the robot that matter [rad or m], and what is said about them.

    Args:
        found: what the topics of the encoders hold, in the unit of the bag.
        robot: its tree says which joints matter.
        bag: path of the bag, for messages to the user.

    Raises:
        RecordingError: one of them moves.
    """
    others = tuple(getattr(robot.tree, "other_joints", ()))
    seen = {joint: values for joint in others if len(values := _positions(found, joint)) >= FEWEST}
    if not seen:
        return {}, []
    source = robot.motor_encoder.source
    if any(abs(abs(scale) - 1.0) > 1e-9 for scale in source.scale):
        text = (
            f"motor_encoder: {', '.join(seen)} stand in the messages, too, but the scale of their values is not known "
            "(`scale` in the robot file is another for each joint); they are held where `locked` of the robot file says"
        )
        return {}, [Notice("motor_encoder", "posture", len(seen), text)]
    posture, moving = dict[str, float](), dict[str, tuple[float, str]]()
    for joint, values in seen.items():
        unit = _unit_of(robot, joint)
        low, middle, high = np.quantile(values, [OUTLYING, 0.5, 1.0 - OUTLYING]) * si_factor(unit)
        if high - low > STILL[si_unit(unit)]:
            moving[joint] = (float(high - low), si_unit(unit))
        posture[joint] = float(middle)
    if moving:
        _refuse(moving, robot, bag)
    return posture, [_notice(posture, robot)]


def _positions(found: Sequence[MessageParts], joint: str) -> NDArray[np.float64]:
    """All finite values of a joint, shape (n,)."""
    values = [
        part.values[:, part.names.index(joint)]
        for parts in found
        for part in parts.parts
        if part.names and joint in part.names and len(part.names) == part.values.shape[1]
    ]
    all_values = np.concatenate(values) if values else np.empty(0)
    return all_values[np.isfinite(all_values)]


def _unit_of(robot: Robot, joint: str) -> str:
    """Unit in the bag of a joint outside the robot: that of the robot's joints of its kind."""
    wanted = "m" if joint in getattr(robot.tree, "other_slides", ()) else "rad"
    units = robot.motor_encoder.source.bag_units(robot.n)
    return next((unit for unit in units if si_unit(unit) == wanted), wanted)


def _refuse(moving: dict[str, tuple[float, str]], robot: Robot, bag: str) -> None:
    said = ", ".join(f"{joint} moves by {span:.2g} {unit}" for joint, (span, unit) in moving.items())
    joints = ",".join([*robot.joints, *moving])
    raise RecordingError(
        f"{bag}: {said}, but the robot file has {'it' if len(moving) == 1 else 'them'} not in `joints`; expected joints "
        f"outside the robot to stand still: jointscope init {robot.tree.urdf} {bag} --joints {joints} -o NEW.yaml, or "
        "use a recording in which it is held"
    )


def _notice(posture: dict[str, float], robot: Robot) -> Notice:
    locked = dict(getattr(robot.tree, "locked", {}))
    parts = []
    for joint, value in posture.items():
        unit = si_unit(_unit_of(robot, joint))
        other = locked.get(joint)
        differs = other is not None and abs(other - value) > NOTICEABLE[unit]
        parts.append(f"{joint} at {value:.4g} {unit}" + (f" (the robot file says {other:.4g})" if differs else ""))
    return Notice("motor_encoder", "posture", len(posture), f"held where the bag has them: {', '.join(parts)}")
