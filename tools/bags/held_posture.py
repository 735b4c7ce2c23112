# SPDX-License-Identifier: BSD-3-Clause
"""Where the joints stand that a robot file does not model, as far as the encoders' messages name them.

Joints of the URDF that stay where they are carry weight and turn axes: the bodies must stand as they stood. A joint
that moves without being modelled makes every result wrong, so it is an error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import init_command
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice
from jointscope.robots.units import si_factor, si_unit
from jointscope.tools.bags.messages.message_parts import MessageParts
from jointscope.tools.bags.tidying.not_finite import LARGEST
from jointscope.tools.bags.tidying.second_publisher import of_second_publisher

Array = NDArray[np.float64]

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
    found = [of_drivers(parts) for parts in found]
    names = _other_names(found, robot)
    at_mean = robot.held_at_mean
    ranges = {
        name: (unit_of_other(robot, joint), _range(found, name, joint in at_mean)) for name, joint in names.items()
    }
    ends = [
        robot.tree.posture({names[name]: spans[k] * si_factor(unit) for name, (unit, spans) in ranges.items() if spans})
        for k in range(3)
    ]
    low, middle, high = ends
    if not middle:
        return {}, []
    source = robot.motor_encoder.source
    if any(abs(abs(scale) - 1.0) > 1e-9 for scale in source.scale):
        text = (
            f"motor_encoder: {', '.join(middle)} stand in the messages, too, but how their values become angles is not "
            "known (`scale` in the robot file is that of other joints); they are held where `locked` of the robot file "
            "says"
        )
        return {}, [Notice("motor_encoder", "posture", len(middle), text)]
    units = {joint: "m" if robot.tree.is_slide(joint) else "rad" for joint in middle}
    spans = {joint: abs(high[joint] - low[joint]) for joint in middle}
    moving = {joint: (spans[joint], units[joint]) for joint in middle if spans[joint] > STILL[units[joint]]}
    on_word = {joint: size for joint, size in moving.items() if joint in robot.held_at_mean}
    if len(moving) > len(on_word):
        _refuse({joint: size for joint, size in moving.items() if joint not in on_word}, robot, bag)
    notices = [_notice(middle, units, robot)]
    if on_word:
        said = ", ".join(f"{joint} moves by {span:.2g} {unit}" for joint, (span, unit) in on_word.items())
        text = (
            f"{said}, and is held at its mean on the word of the robot file (`held_at_mean`): values of joints that "
            "feel it are wrong by that"
        )
        notices.append(Notice("motor_encoder", "unit", len(on_word), text))
    return middle, notices


def of_drivers(found: MessageParts) -> MessageParts:
    """The messages without those of a second node that always says the same: a joint at rest jumps by them.

    The joints that move tell which ones they are.
    """
    kept = []
    for part in found.parts:
        sound = part.values[:, np.all(np.abs(part.values) < LARGEST, axis=0)]
        foreign = of_second_publisher(sound) if sound.size else np.zeros(len(part.values), bool)
        kept.append(part.take(np.flatnonzero(~foreign)) if foreign.any() else part)
    return replace(found, parts=tuple(kept))


def _other_names(found: Sequence[MessageParts], robot: Robot) -> dict[str, str]:
    """Names in the messages that are not the robot's, and the joint of the URDF that each stands for."""
    own = robot.motor_encoder.source.names
    prefixes = {name.removesuffix(joint) for name, joint in zip(own, robot.joints, strict=False)}
    prefix = prefixes.pop() if len(prefixes) == 1 else ""
    seen = dict.fromkeys(name for parts in found for part in parts.parts for name in part.names or ())
    return {name: name.removeprefix(prefix) for name in seen if name not in own}


def _range(found: Sequence[MessageParts], name: str, mean: bool) -> tuple[float, float, float] | None:
    """Smallest, middle (or mean) and largest value of a name, without outliers; None where there are too few."""
    every = np.concatenate([_values_of(parts, name) for parts in found])
    if len(every) < FEWEST:
        return None
    low, middle, high = np.quantile(every, [OUTLYING, 0.5, 1.0 - OUTLYING])
    if mean:
        middle = np.mean(every[(every >= low) & (every <= high)])
    return float(low), float(middle), float(high)


def _values_of(found: MessageParts, name: str) -> Array:
    """What messages of all sizes say of a name, in the order of the bag, without a node that repeats itself."""
    rows, values = [np.empty(0, np.intp)], [np.empty(0)]
    for part in found.parts:
        names = part.names or ()
        if name in names and len(names) == part.values.shape[1]:
            rows.append(np.arange(len(part.values)) if part.rows is None else part.rows)
            values.append(part.values[:, names.index(name)])
    every = np.concatenate(values)[np.argsort(np.concatenate(rows), kind="stable")]
    every = every[np.abs(every) < LARGEST]
    return every[~of_second_publisher(every[:, None])]


def unit_of_other(robot: Robot, joint: str) -> str:
    """Unit in the bag of a joint outside the robot: that of the robot's joints of its kind."""
    wanted = "m" if robot.tree.is_slide(joint) else "rad"
    units = robot.motor_encoder.source.bag_units(robot.n)
    return next((unit for unit in units if si_unit(unit) == wanted), wanted)


def _refuse(moving: dict[str, tuple[float, str]], robot: Robot, bag: str) -> None:
    said = ", ".join(f"{joint} moves by {span:.2g} {unit}" for joint, (span, unit) in moving.items())
    command = init_command(robot, bag, "with_them", joints=[*robot.joints, *moving])
    raise RecordingError(
        f"{bag}: {said}, but the robot file has {'it' if len(moving) == 1 else 'them'} not in `joints`; expected the "
        f"other joints to stand still: {command}, or use a recording in which they are held"
    )


def _notice(posture: dict[str, float], units: dict[str, str], robot: Robot) -> Notice:
    parts = []
    for joint, value in posture.items():
        filed = robot.tree.locked.get(joint)
        differs = filed is not None and abs(filed - value) > NOTICEABLE[units[joint]]
        said = f"{joint} at {value:.4g} {units[joint]}"
        parts.append(said + (f" (the robot file says {filed:.4g})" if differs else ""))
    return Notice("motor_encoder", "posture", len(posture), f"held where the bag has them: {', '.join(parts)}")
