# SPDX-License-Identifier: BSD-3-Clause
"""The sound little recording that the fuzzer damages, message by message, and how it becomes a bag of any kind."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from arm_bodies import ArmBodies
from arm_drives import Drives
from arm_motion import make_motion
from arm_simulation import simulate
from arm_urdf import read_urdf

FORMATS = ("bag", "folder", "db3", "mcap")
JOINT_STATE, ARRAY, IMU, TEXT = (
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Float64MultiArray",
    "sensor_msgs/msg/Imu",
    "std_msgs/msg/String",
)
START_NS = 1_700_000_000_000_000_000
SECONDS, RATE = 2.0, 50.0
URDF = """<robot name="two">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="3"/>
    <inertia ixx="0.04" iyy="0.04" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0 0 -0.15"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="100" velocity="9"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 -0.4"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="50" velocity="9"/></joint>
</robot>
"""


@dataclass(frozen=True)
class Message:
    """One message of any of the four types; a type takes of the fields what it has.

    Attributes:
        topic, kind: where it stands and its type.
        stamp: of its header [ns], may be anything.
        received: when it was written [ns].
        name, position, velocity, effort: as in a JointState; an array holds the efforts, a text the names.
        frame: of its header.
    """

    topic: str
    kind: str
    stamp: int
    received: int
    name: tuple[str, ...] = ()
    position: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()
    frame: str = ""


@cache
def sound_messages() -> tuple[Message, ...]:
    """Two seconds of a two-joint arm, from which a robot file can be made."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "two.urdf"
        path.write_text(URDF, encoding="utf-8")
        urdf = read_urdf(path)
    names = ("shoulder", "elbow")
    rng = np.random.default_rng(5)
    bodies = ArmBodies(urdf, names, {})
    motion = make_motion([urdf.joints[name] for name in names], np.array([0.4, -0.6]), rng)
    drives = Drives(np.array([0.3, 0.08]), np.array([0.6, 0.2]), np.array([0.8, 0.2]), np.ones(2))
    times = np.arange(0.004, SECONDS, 1 / RATE)
    run = simulate(bodies, drives, motion, times, times + 0.003)
    measured = run.positions + 2e-5 * rng.standard_normal(run.positions.shape)
    made = []
    for time, u in zip(run.command_times, run.commands, strict=True):
        stamp = START_NS + round(time * 1e9)
        made.append(Message("/motor_command", JOINT_STATE, stamp, stamp + 10_000, names, effort=tuple(u.tolist())))
    for time, q in zip(run.state_times, measured, strict=True):
        stamp = START_NS + round(time * 1e9)
        made.append(Message("/joint_states", JOINT_STATE, stamp, stamp + 10_000, names, position=tuple(q.tolist())))
    return tuple(sorted(made, key=lambda message: message.received))


def write_messages(path: Path, messages: Sequence[Message], fmt: str) -> Path:
    """Writes a bag whose content may be odd, but which is sound as a file; returns its path with suffix."""
    if fmt == "bag":
        return _ros1(path.with_suffix(".bag"), messages)
    from rosbags.rosbag2 import StoragePlugin, Writer

    plugin = StoragePlugin.SQLITE3 if fmt == "db3" else StoragePlugin.MCAP
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        _write(writer, messages, ros2=True)
    if fmt == "folder":
        return path
    single = path.with_suffix(f".{fmt}")
    next(path.glob(f"*.{fmt}")).rename(single)
    shutil.rmtree(path)
    return single


def _ros1(path: Path, messages: Sequence[Message]) -> Path:
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        _write(writer, messages, ros2=False)
    return path


def _write(writer: Any, messages: Sequence[Message], ros2: bool) -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE if ros2 else Stores.ROS1_NOETIC)
    connections: dict[tuple[str, str], Any] = {}
    latest = 2**62 if ros2 else (2**32 - 1) * 10**9
    for message in messages:
        key = (message.topic, message.kind)
        if key not in connections:
            connections[key] = writer.add_connection(*key, typestore=store)
        content = _content(store.types, message, ros2)
        data = (store.serialize_cdr if ros2 else store.serialize_ros1)(content, message.kind)
        writer.write(connections[key], min(max(message.received, 0), latest), data)


def _content(types: Any, m: Message, ros2: bool) -> Any:
    numbers = {field: np.array(getattr(m, field), float) for field in ("position", "velocity", "effort")}
    if m.kind == ARRAY:
        return types[ARRAY](
            layout=types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0), data=numbers["effort"]
        )
    if m.kind == TEXT:
        return types[TEXT](data=" ".join(m.name))
    seconds, nanoseconds = divmod(m.stamp, 10**9)
    lowest = -(2**31) if ros2 else 0
    stamp = types["builtin_interfaces/msg/Time"](sec=min(max(seconds, lowest), 2**31 - 1), nanosec=nanoseconds)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=m.frame, **({} if ros2 else {"seq": 0}))
    if m.kind == IMU:
        vector, three = types["geometry_msgs/msg/Vector3"], (*m.position, 0.0, 0.0, 0.0)[:3]
        turn = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
        nothing = {
            f"{part}_covariance": np.zeros(9) for part in ("orientation", "angular_velocity", "linear_acceleration")
        }
        moved = {"angular_velocity": vector(*three), "linear_acceleration": vector(0.0, 0.0, 9.81)}
        return types[IMU](header=header, orientation=turn, **moved, **nothing)
    return types[JOINT_STATE](header=header, name=list(m.name), **numbers)


def with_fields(message: Message, **fields: Any) -> Message:
    """A message with other fields."""
    return replace(message, **fields)
