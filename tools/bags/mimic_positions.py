# SPDX-License-Identifier: BSD-3-Clause
"""Whether mimic joints are, in the bag, where the URDF says that they follow to.

What a mimic joint carries is modelled where its leader puts it. A URDF whose multiplier has the wrong sign or size puts
it somewhere else, and the values of all joints below it are wrong. Where a bag names the joint, its motion tells.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice
from jointscope.robots.units import si_factor
from jointscope.tools.bags.held_posture import FEWEST, OUTLYING, STILL, of_drivers, unit_of_other
from jointscope.tools.bags.messages.message_parts import MessageParts
from jointscope.tools.bags.tidying.not_finite import LARGEST

Array = NDArray[np.float64]
DIGITS = 3


def mimic_notices(found: Sequence[MessageParts], robot: Robot) -> list[Notice]:
    """What is said of mimic joints that move otherwise than the URDF says; one that stands in the bag is left alone.

    Args:
        found: what the topics of the encoders hold, in the unit of the bag.
        robot: its tree says what follows what.
    """
    source, notices = robot.motor_encoder.source, list[Notice]()
    found = [of_drivers(parts) for parts in found] if robot.tree.followers else []
    names = dict(zip(robot.joints, source.names or robot.joints, strict=True))
    units = dict(zip(robot.joints, source.bag_units(robot.n), strict=True))
    scales = dict(zip(robot.joints, np.broadcast_to(source.scale, robot.n), strict=True))
    for joint, follower in robot.tree.followers.items():
        leader = follower.leader
        if leader not in names or abs(abs(scales[leader]) - 1.0) > 1e-9:
            continue  # how values become angles is not known of the others
        prefix = names[leader].removesuffix(leader) if names[leader].endswith(leader) else ""
        pairs = _pairs(found, names[leader], prefix + joint)
        if pairs is None:
            continue
        own, unit = unit_of_other(robot, joint), "m" if robot.tree.is_slide(joint) else "rad"
        q, p = scales[leader] * si_factor(units[leader]) * pairs[0], si_factor(own) * pairs[1]
        off = np.abs(p - (follower.factor * q + follower.offset))
        if _span(p) <= STILL[unit] or float(np.quantile(off, 1.0 - OUTLYING)) <= STILL[unit]:
            continue
        factor, offset = np.round(np.polyfit(q, p, 1), DIGITS) + 0.0
        notices.append(
            Notice(
                "motor_encoder",
                "mimic",
                1,
                f"{joint} follows {leader} in {robot.tree.urdf.name} with multiplier {follower.factor:g} and offset "
                f"{follower.offset:g}, but in the bag with {factor:g} and {offset:g} (up to "
                f"{float(np.max(off)):.2g} {unit} from there): what it carries is modelled where it "
                "is not; correct its <mimic> in the URDF, or the sign with which the driver publishes it",
            )
        )
    return notices


def _pairs(found: Sequence[MessageParts], leader: str, joint: str) -> tuple[Array, Array] | None:
    """Values of two names in the messages that have both; None where there are too few."""
    every = [
        part.values[:, [part.names.index(leader), part.names.index(joint)]]
        for parts in found
        for part in parts.parts
        if part.names and {leader, joint} <= set(part.names) and len(part.names) == part.values.shape[1]
    ]
    values = np.concatenate(every) if every else np.empty((0, 2))
    values = values[np.all(np.abs(values) < LARGEST, axis=1)]
    return (values[:, 0], values[:, 1]) if len(values) >= FEWEST else None


def _span(values: Array) -> float:
    low, high = np.quantile(values, [OUTLYING, 1.0 - OUTLYING])
    return float(high - low)
