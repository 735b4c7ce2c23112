# SPDX-License-Identifier: BSD-3-Clause
"""A message type as a bag defines it: its fields, and how its bytes become a message and back."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

from jointscope.robots.errors import RecordingError

NUMPY_TYPES = {
    "bool": "u1", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2",
    "int32": "<i4", "uint32": "<u4", "int64": "<i8", "uint64": "<u8", "float32": "<f4", "float64": "<f8",
}  # fmt: skip
"""ROS primitive: numpy type of its little-endian bytes; `byte` is signed in ROS 1."""


@dataclass(frozen=True)
class MessageType:
    """A type with the definitions it needs.

    Attributes:
        name: for example "sensor_msgs/msg/Imu".
        typestore: definitions of this type and of all types inside it.
        ros2: True for CDR bytes, False for ROS 1 serialization.
    """

    name: str
    typestore: Any
    ros2: bool

    @property
    def fields(self) -> list[tuple[str, Any]]:
        """Name and description of each field, in order."""
        return self.fields_of(self.name)

    def fields_of(self, msgtype: str) -> list[tuple[str, Any]]:
        """Name and description of each field of a type inside this one."""
        return list(self.typestore.get_msgdef(msgtype).fields)

    @property
    def has_header(self) -> bool:
        """Whether the messages carry a stamp of their own."""
        return any(name == "header" and str(kind[1]) == "std_msgs/msg/Header" for name, kind in self.fields)

    def numpy_type(self, primitive: str) -> str:
        """The numpy type of a primitive's little-endian bytes.

        Raises:
            KeyError: it is no number.
        """
        return "i1" if primitive == "byte" and not self.ros2 else NUMPY_TYPES[primitive]

    def holds_bytes(self, field: str) -> bool:
        """Whether a dotted field holds nothing but `byte`."""
        kind: Any = None
        inside: str | None = self.name
        for part in field.split("."):
            if part.isdecimal() or part == "*":
                continue
            fields = dict(self.fields_of(inside)) if inside is not None else {}
            if part not in fields:
                return False
            kind = fields[part]
            inside = inner_type(kind)
        return kind is not None and primitive_type(kind) == "byte"

    def decode(self, raw: bytes) -> Any:
        """The message with these bytes.

        Raises:
            RecordingError: they are none of this type.
        """
        read = self.typestore.deserialize_cdr if self.ros2 else self.typestore.deserialize_ros1
        try:
            return read(raw, self.name)
        except Exception as err:  # the decoder leaks errors of many kinds on damaged bytes
            raise RecordingError(f"{len(raw)} bytes are not a {self.name}; the bag is damaged") from err

    def encode(self, message: Any) -> bytes:
        """The bytes of a message."""
        if self.ros2:
            return bytes(self.typestore.serialize_cdr(message, self.name))
        return bytes(self.typestore.serialize_ros1(message, self.name))


def full_type_name(name: str, ros2: bool) -> str:
    """The name of a type in three parts: writers of MCAP files other than rosbag2 leave out the one in the middle.

    >>> full_type_name("sensor_msgs/JointState", True)
    'sensor_msgs/msg/JointState'
    """
    return name.replace("/", "/msg/") if ros2 and name.count("/") == 1 else name


def inner_type(kind: Any) -> str | None:
    """The message type inside a field or its elements; None for primitives."""
    from rosbags.interfaces import Nodetype

    if kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        kind = kind[1][0]
    return str(kind[1]) if kind[0] == Nodetype.NAME else None


def primitive_type(kind: Any) -> str | None:
    """The primitive in a field or its elements; None for messages."""
    from rosbags.interfaces import Nodetype

    if kind[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
        kind = kind[1][0]
    return str(kind[1][0]) if kind[0] == Nodetype.BASE else None


def is_list_of_texts(kind: Any) -> bool:
    """Whether a field is a list of texts."""
    from rosbags.interfaces import Nodetype

    return kind[0] in (Nodetype.SEQUENCE, Nodetype.ARRAY) and is_text(kind[1][0])


def is_text(kind: Any) -> bool:
    """Whether a field is one text."""
    from rosbags.interfaces import Nodetype

    return bool(kind[0] == Nodetype.BASE and kind[1][0] == "string")


def known_message_type(name: str, ros2: bool) -> MessageType:
    """A type from the definitions that ROS itself ships, for bags that carry none and for writing.

    Raises:
        RecordingError: ROS ships no such type.
    """
    typestore = _shipped(ros2)
    if name not in typestore.fielddefs:
        raise RecordingError(
            f"the message type {name!r} is unknown: neither the bag nor ROS {2 if ros2 else 1} itself defines it"
        )
    return MessageType(name, typestore, ros2)


@functools.lru_cache(maxsize=64)  # rosbags compiles a decoder for every type store
def defined_message_type(name: str, definition: Any, ros2: bool) -> MessageType:
    """A type from the definition that a bag carries.

    Args:
        name: the type.
        definition: rosbags' MessageDefinition of the connection; without text, ROS's own definition is used.
        ros2: whether the bag is one of ROS 2.
    """
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if definition.format == MessageDefinitionFormat.NONE or not definition.data.strip():
        return known_message_type(name, ros2)
    if definition.format == MessageDefinitionFormat.MSG:
        types = get_types_from_msg(definition.data, name)
    else:
        rule = "=" * 80 + "\n"
        types = {}
        for part in definition.data.split(rule) if definition.data.startswith(rule) else [definition.data]:
            types.update(get_types_from_idl(part.split("\n", 1)[1] if part.startswith("IDL: ") else part))
    typestore = get_typestore(Stores.EMPTY)
    typestore.register(types)
    return MessageType(name, typestore, ros2)


@functools.cache
def _shipped(ros2: bool) -> Any:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE if ros2 else Stores.ROS1_NOETIC)
