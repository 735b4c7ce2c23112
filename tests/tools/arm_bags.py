# SPDX-License-Identifier: BSD-3-Clause
"""Bags of made-up arms, message by message: which joints move, which are commanded, and what they are called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from jointscope.robots.bodies.rigid_tree import RigidTree

TYPES = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values",
    "control_msgs/msg/DynamicJointState": "std_msgs/Header header\nstring[] joint_names\n"
    "control_msgs/InterfaceValue[] interface_values",
    "own_msgs/msg/MotorState": "float32 q\nfloat32 dq\nfloat32 tau_est",
    "own_msgs/msg/LowState": "uint8 level\nown_msgs/MotorState[] motor_state",
}
LINK = (
    '<link name="{name}"><inertial><origin xyz="0 0 -0.15"/><mass value="2"/>'
    '<inertia ixx="0.02" iyy="0.02" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
    '<origin xyz="0 0 {down}"/><axis xyz="{axis}"/><limit lower="-2.9" upper="2.9" effort="100" velocity="9"/>'
    "{more}</joint>"
)
NO_ROWS = ("names", "type", "stamped", "rows")
AXES = ("0 1 0", "1 0 0", "0 0 1")


def write_urdf(path: Path, parents: Mapping[str, str | None], mimics: Mapping[str, str] | None = None) -> Path:
    """A URDF of joints, each with the one before it (None: the base); axes take turns along the chain."""
    depth: dict[str, int] = {}
    text = '<robot name="arm"><link name="base"/>'
    for name, parent in parents.items():
        depth[name] = 0 if parent is None else depth[parent] + 1
        more = f'<mimic joint="{mimics[name]}" multiplier="-1"/>' if mimics and name in mimics else ""
        child, before = f"{name}_link", "base" if parent is None else f"{parent}_link"
        axis = AXES[depth[name] % 3]
        down = "0" if parent is None else "-0.3"
        text += LINK.format(name=child)
        text += JOINT.format(name=name, parent=before, child=child, down=down, axis=axis, more=more)
    path.write_text(text + "</robot>")
    return path


class ArmMotion:
    """Joints that move or stand, and the torques that this takes.

    Args:
        urdf: the robot.
        moving: joints that move.
        standing: where others stand [rad].
        seconds, rate, seed: of the recording.
        noise: of the encoders [rad].
    """

    def __init__(
        self,
        urdf: Path,
        moving: Sequence[str],
        standing: Mapping[str, float] | None = None,
        seconds: float = 6.0,
        rate: float = 200.0,
        seed: int = 1,
        noise: float = 2e-5,
    ):
        rng = np.random.default_rng(seed)
        standing = standing or {}
        self.times = np.arange(0.0, seconds, 1.0 / rate)
        self.tree = RigidTree(urdf, moving, np.array([0.0, 0.0, -9.81]), locked=standing)
        omega, phase = rng.uniform(2.0, 9.0, (3, len(moving))), rng.uniform(0.0, 6.0, (3, len(moving)))
        angle = self.times[:, None, None] * omega + phase
        self.q = 0.2 * np.sin(angle).sum(axis=1)
        self.v = 0.2 * (omega * np.cos(angle)).sum(axis=1)
        a = -0.2 * (omega**2 * np.sin(angle)).sum(axis=1)
        self.torque = self.tree.torque(self.q, self.v, a) + 0.4 * self.v + 0.3 * np.sign(self.v) + 0.05 * a
        self.position = {name: self.q[:, j] for j, name in enumerate(moving)}
        self.position |= {name: np.full(len(self.times), at) for name, at in standing.items()}
        self.position = {name: x + noise * rng.standard_normal(len(x)) for name, x in self.position.items()}
        self.effort = {name: self.torque[:, j] for j, name in enumerate(moving)}

    def states(self, names: Sequence[str] | None = None, called: Mapping[str, str] | None = None) -> dict[str, object]:
        """Joint states of some joints, in an order, under other names."""
        names = sorted(self.position) if names is None else names
        values = np.column_stack([self.position[name] for name in names])
        return {"names": [(called or {}).get(name, name) for name in names], "position": values}

    def commands(self, names: Sequence[str], called: Mapping[str, str] | None = None) -> dict[str, object]:
        """Torques of some joints; of those that stand a constant one."""
        zero = np.full(len(self.times), 0.7)
        values = np.column_stack([self.effort.get(name, zero) for name in names])
        return {"names": [(called or {}).get(name, name) for name in names], "effort": values}

    def gyro(self, body: str, R_imu_body: np.ndarray, seed: int = 3) -> np.ndarray:
        """Rates of a body by differences of its orientation, shape (n, 3) [rad/s]."""
        h = 1e-5
        before, after = (self.tree.body_poses(body, self.q + s * h * self.v)[0] for s in (-1, 1))
        spin = np.einsum("kji,kjl->kil", self.tree.body_poses(body, self.q)[0], (after - before) / (2 * h))
        omega = np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])
        return omega @ R_imu_body.T + 2e-3 * np.random.default_rng(seed).standard_normal(omega.shape)


def write_arm_bag(
    path: Path, times: np.ndarray, topics: Mapping[str, Mapping[str, object]], latency: float = 0.0
) -> Path:
    """A bag; each topic holds JointStates, or what its `type` says.

    Args:
        path: an .mcap.
        times: of all messages, shape (n,) [s].
        topics: names, position and effort of joints, `data` of arrays, `rate` of gyroscopes; `stamped` makes the
            stamp in the header from the true one [ns], `rows` are the times at which it publishes. What follows a `#`
            tells several publishers of one topic apart.
        latency: from the true stamp to the reception [s].
    """
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in TYPES.items():
        store.register(get_types_from_msg(text, name))
    folder = path.with_suffix("")
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}
        for topic, content in topics.items():
            kind, name = _kind(content), topic.partition("#")[0]
            if name not in connections:
                connections[name] = writer.add_connection(name, kind, typestore=store)
            connection = connections[name]
            for k in content.get("rows", range(len(times))):
                t = times[k]
                stamp = 10**18 + round(float(t) * 1e9)
                written = content.get("stamped", int)(stamp)
                message = _message(store, kind, content, k, written)
                writer.write(connection, stamp + round(1e9 * latency), store.serialize_cdr(message, kind))
    next(folder.glob("*.mcap")).rename(path)
    return path


def _kind(content: Mapping[str, object]) -> str:
    if "type" in content:
        return str(content["type"])
    if "rate" in content:
        return "sensor_msgs/msg/Imu"
    return "std_msgs/msg/Float64MultiArray" if "data" in content else "sensor_msgs/msg/JointState"


def _message(store, kind, content, k, stamp):
    types = store.types
    time = types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    header = types["std_msgs/msg/Header"](time, "")
    row = {key: np.asarray(values)[k].astype(float) for key, values in content.items() if key not in NO_ROWS}
    none = np.zeros(0)
    if kind == "sensor_msgs/msg/Imu":
        vector = types["geometry_msgs/msg/Vector3"]
        still, nine = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0), np.zeros(9)
        return types[kind](header, still, nine, vector(*row["rate"]), nine, vector(0.0, 0.0, 0.0), nine)
    if kind in ("std_msgs/msg/Float64", "std_msgs/msg/Float32"):
        return types[kind](float(row["data"][0]))
    if kind == "std_msgs/msg/Float64MultiArray":
        return types[kind](types["std_msgs/msg/MultiArrayLayout"]([], 0), row["data"])
    if kind == "control_msgs/msg/DynamicJointState":
        one = types["control_msgs/msg/InterfaceValue"]
        parts = [
            one(["effort", "position"], np.array([e, p])) for e, p in zip(row["effort"], row["position"], strict=True)
        ]
        return types[kind](header, list(content["names"]), parts)
    if kind == "own_msgs/msg/LowState":
        one = types["own_msgs/msg/MotorState"]
        pairs = zip(row["position"], row["effort"], strict=True)
        return types[kind](1, [one(float(p), 0.0, float(e)) for p, e in pairs])
    return types[kind](header, list(content["names"]), row.get("position", none), none, row.get("effort", none))
