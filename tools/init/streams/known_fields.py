# SPDX-License-Identifier: BSD-3-Clause
"""Which numbers of a message could be positions, efforts or rates of joints, by the words that drivers use.

Known are the types of ROS itself, those of its controllers (states with `actual`, `feedback`, `output`; points of
trajectories; interfaces by name) and arrays with one element per motor.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from jointscope.robots.errors import RecordingError
from jointscope.tools.bags.messages.field_path import EVERY
from jointscope.tools.bags.messages.message_type import MessageType, is_list_of_texts

IMU = "sensor_msgs/msg/Imu"
ARRAYS = re.compile(r"std_msgs/msg/Float(32|64)(MultiArray)?")
WORDS = {
    "position": "position positions q present_position joint_position joint_positions angles",
    "effort": "effort efforts tau tau_est tauest tau_j tau_j_d torque torques joint_torque joint_torques "
    "current currents pwm duty voltage",
}
"""Quantity: what its field may be called."""
QUANTITIES = {word: quantity for quantity, words in WORDS.items() for word in words.split()}
FLOATS = ("float32", "float64")
NO_JOINTS = re.compile(r"(^|\.)(error|velocity_error|position_error)\.")
DEEPEST = 4  # fields inside fields


@dataclass(frozen=True)
class KnownField:
    """A field, and what it could be: "position", "effort", "rate", "acceleration" or "numbers"."""

    path: str
    quantity: str


def known_fields(kind: MessageType, first: bytes | None) -> list[KnownField]:
    """What of a message type a robot file could use.

    Args:
        kind: the type.
        first: one message, which says what interfaces are called; None to leave those out.
    """
    if kind.name == IMU:
        return [KnownField("angular_velocity", "rate"), KnownField("linear_acceleration", "acceleration")]
    if ARRAYS.fullmatch(kind.name):
        return [KnownField("data", "numbers")]
    found = [KnownField(path, QUANTITIES[word]) for path in _floats(kind, kind.name, "") if (word := _word(path))]
    return found + (_interfaces(kind, first) if first is not None else [])


def _word(path: str) -> str:
    """The last word of a path if it is that of a quantity of joints."""
    word = path.rpartition(".")[2].lower()
    return word if word in QUANTITIES and not NO_JOINTS.search(path) else ""


def _floats(kind: MessageType, msgtype: str, path: str) -> list[str]:
    """Paths of lists of floats, and of single floats in the elements of lists."""
    from rosbags.interfaces import Nodetype

    if path.count(".") > DEEPEST:
        return []
    found = []
    for name, what in kind.fields_of(msgtype):
        here = f"{path}.{name}" if path else name
        element = what[1][0] if what[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) else what
        if element[0] == Nodetype.NAME:
            inside = here if element is what else f"{here}.{_which(name)}"
            found += _floats(kind, str(element[1]), inside)
        elif element[1][0] in FLOATS and (element is not what or f".{EVERY}" in path):
            found.append(here)
    return found


def _which(name: str) -> str:
    """Points of a trajectory follow each other in time, the first one acts now; other elements are joints."""
    return "0" if name == "points" else EVERY


def _interfaces(kind: MessageType, first: bytes) -> list[KnownField]:
    """Numbers that each element names itself, as in `DynamicJointState`."""
    found = []
    for name, what in kind.fields:
        inner = _element(what)
        fields = dict(kind.fields_of(inner)) if inner else {}
        texts = [part for part, sub in fields.items() if is_list_of_texts(sub)]
        numbers = [part for part, sub in fields.items() if _is_list_of_floats(sub)]
        if not texts or not numbers:
            continue
        try:
            items: list[Any] = list(getattr(kind.decode(first), name))
        except RecordingError:
            continue
        common = set.intersection(*(set(getattr(item, texts[0])) for item in items)) if items else set()
        found += [
            KnownField(f"{name}.{EVERY}.{numbers[0]}.{word}", QUANTITIES[word])
            for word in sorted(common)
            if word in QUANTITIES
        ]
    return found


def _element(what: Any) -> str | None:
    from rosbags.interfaces import Nodetype

    listed = what[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) and what[1][0][0] == Nodetype.NAME
    return str(what[1][0][1]) if listed else None


def _is_list_of_floats(what: Any) -> bool:
    from rosbags.interfaces import Nodetype

    return bool(
        what[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE) and what[1][0][0] == Nodetype.BASE and what[1][0][1][0] in FLOATS
    )
