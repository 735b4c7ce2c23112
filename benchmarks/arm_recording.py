# SPDX-License-Identifier: BSD-3-Clause
"""Records a simulated arm as drivers do, and writes down what is true: robot.urdf, train.mcap, truth.json."""

from __future__ import annotations

import json
import shutil
import tempfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from arm_bodies import ArmBodies
from arm_cases import ArmCase, urdf_file
from arm_drives import Drives, loads, make_drives
from arm_motion import make_motion
from arm_simulation import Run, simulate
from arm_urdf import Urdf, read_urdf
from numpy.typing import NDArray

Array = NDArray[np.float64]
SECONDS = 10.0
START_NS = 1_700_000_000_000_000_000
JITTER = 0.03  # of a period, either way
RECEIVED = 20_000  # [ns] after the stamp
NOISE = {"turns": 2e-5, "slides": 5e-6}  # [rad], [m]
EFFORT_NOISE = 0.002  # of the largest measured effort
REACH = 1.2  # [rad or m] from zero, of a posture
STRANGERS = ("gripper_motor", "imu_gimbal")  # names of no joint


@dataclass(frozen=True)
class Recorded:
    """An arm, what it did, and the posture of all joints that are no mimics."""

    case: ArmCase
    urdf: Urdf
    bodies: ArmBodies
    drives: Drives
    unit: str
    posture: dict[str, float]
    run: Run


def record(case: ArmCase, folder: Path) -> None:
    """Simulates a case and writes its three files."""
    source = urdf_file(case)
    rng = np.random.default_rng(zlib.crc32(case.name.encode()))
    recorded = _simulated(case, read_urdf(source), rng)
    topics = _topics(recorded, rng)
    with tempfile.TemporaryDirectory(dir=folder.parent) as unfinished:
        made = Path(unfinished) / folder.name
        made.mkdir()
        shutil.copyfile(source, made / "robot.urdf")
        write_topics(made / "train.mcap", topics)
        (made / "truth.json").write_text(json.dumps(_truth(recorded, len(topics[0].names)), indent=1), encoding="utf-8")
        made.rename(folder)


def excited(case: ArmCase, urdf: Urdf) -> list[str]:
    """Names of the joints that move, from the base on."""
    chain = urdf.above(urdf.joints[case.last].child)
    free = [joint.name for joint in chain if joint.moves and joint.mimic is None and joint.name not in case.skip]
    return free[-case.count :]


def _simulated(case: ArmCase, urdf: Urdf, rng: np.random.Generator) -> Recorded:
    names = excited(case, urdf)
    joints = [urdf.joints[name] for name in names]
    posture = {
        name: _place(joint.lower, joint.upper, case.held if name not in names else "posture", rng)
        for name, joint in urdf.joints.items()
        if joint.moves and joint.mimic is None
    }
    bodies = ArmBodies(urdf, names, posture)
    motion = make_motion(joints, np.array([posture[name] for name in names]), rng)
    slides = np.array([joint.kind == "prismatic" for joint in joints])
    link_inertia = np.diag(bodies.mass_matrix(motion.centre)).copy()
    load = loads(bodies, motion, SECONDS)
    drives, unit = make_drives(load, link_inertia, slides, case.unit, rng, case.sticks)
    # a drive that tells its own effort gets its command from a loop that is faster than the topic
    commanded = 1000.0 if case.command == "measured" else case.rate
    times = _stamps(commanded, 0.001, rng), _stamps(case.rate, 0.001 + 0.3 / case.rate, rng)
    return Recorded(case, urdf, bodies, drives, unit, posture, simulate(bodies, drives, motion, *times))


def _place(lower: float, upper: float, held: str, rng: np.random.Generator) -> float:
    """A place between the limits, not too near to them, and near zero where there is much room."""
    if held == "zero" and lower <= 0.0 <= upper:
        return 0.0
    width = upper - lower
    low, high = (lower + 0.3 * width, upper - 0.3 * width) if np.isfinite(width) else (-REACH, REACH)
    if low < REACH and high > -REACH:
        low, high = max(low, -REACH), min(high, REACH)
    return round(float(rng.uniform(low, high)), 4)


def _stamps(rate: float, first: float, rng: np.random.Generator) -> Array:
    n = int((SECONDS - first) * rate)
    times = first + np.arange(n) / rate + rng.uniform(-JITTER, JITTER, n) / rate
    return np.round(np.maximum(times, 1e-4), 9)


@dataclass(frozen=True)
class Topic:
    """All messages of one topic: stamps [s], names, and fields by name, each of shape (n, names)."""

    name: str
    times: Array
    names: tuple[str, ...]
    fields: dict[str, Array]
    named: bool = True


def _topics(r: Recorded, rng: np.random.Generator) -> list[Topic]:
    names = _published(r, rng)
    positions = np.column_stack([_positions(r, name, rng) for name in names])
    states = {"position": positions}
    if r.case.command == "measured":
        efforts = np.zeros_like(positions)
        for k, joint in enumerate(r.bodies.joints):
            measured = r.run.torques[:, k] / r.drives.k[k]
            noise = EFFORT_NOISE * np.abs(measured).max() * rng.standard_normal(len(measured))
            efforts[:, names.index(joint)] = measured + noise
        return [Topic("/joint_states", r.run.state_times, names, states | {"effort": efforts})]
    return [Topic("/joint_states", r.run.state_times, names, states), _command(r, names, rng)]


def _command(r: Recorded, published: tuple[str, ...], rng: np.random.Generator) -> Topic:
    joints, u = r.bodies.joints, r.run.commands
    if r.case.command in ("group", "array"):
        return Topic("/motor_command", r.run.command_times, joints, {"effort": u}, named=r.case.command == "group")
    names = tuple(name for name in published if name in r.urdf.joints)
    efforts = np.zeros((len(u), len(names)))
    typical = float(np.abs(u).max())
    for k, name in enumerate(names):
        if name in joints:
            efforts[:, k] = u[:, joints.index(name)]
        elif r.case.command == "holding" and r.urdf.joints[name].mimic is None:
            efforts[:, k] = np.round(typical * (rng.uniform(-0.3, 0.3) + 0.002 * rng.standard_normal(len(u))), 6)
    return Topic("/motor_command", r.run.command_times, names, {"effort": efforts})


def _published(r: Recorded, rng: np.random.Generator) -> tuple[str, ...]:
    """Names in /joint_states, in the order of the case."""
    names = sorted(name for name, joint in r.urdf.joints.items() if joint.moves)
    if r.case.order == "no_mimics":
        names = [name for name in names if r.urdf.joints[name].mimic is None]
    if r.case.order == "some":
        names = [name for name in names if _matters(r, name)]
    if r.case.order == "extra":
        names = sorted([*names, *STRANGERS])
    if r.case.order == "shuffled":
        names = [names[k] for k in rng.permutation(len(names))]
    return tuple(names)


def _matters(r: Recorded, name: str) -> bool:
    """Whether a joint moves, carries one that does, or hangs on one."""
    above = {joint.name for moving in r.bodies.joints for joint in r.urdf.above(r.urdf.joints[moving].child)}
    own = {joint.name for joint in r.urdf.above(r.urdf.joints[name].child)}
    return name in above or bool(own & set(r.bodies.joints))


def _positions(r: Recorded, name: str, rng: np.random.Generator) -> Array:
    """What the encoder of a joint says, shape (n,)."""
    n = len(r.run.state_times)
    if name not in r.urdf.joints:
        true = np.full(n, 0.25)
    else:
        mimic = r.urdf.driver(name)
        joints = r.bodies.joints
        followed = r.run.positions[:, joints.index(mimic.of)] if mimic.of in joints else r.posture[mimic.of]
        true = mimic.factor * np.broadcast_to(followed, n) + mimic.offset
    slides = name in r.urdf.joints and r.urdf.joints[name].kind == "prismatic"
    if r.case.counts:
        grid = (1.0 if slides else 2 * np.pi) / r.case.counts
        return grid * np.round(true / grid)
    return true + NOISE["slides" if slides else "turns"] * rng.standard_normal(n)


def _truth(r: Recorded, published: int) -> dict[str, Any]:
    centre = np.array([r.posture[name] for name in r.bodies.joints])
    return {
        "robot": r.case.name,
        "urdf": f"{r.case.package}: {r.case.path}",
        "joints": list(r.bodies.joints),
        "published": published,
        "unit": r.unit,
        "rate": r.case.rate,
        "held": r.case.held,
        "variant": r.case.variant,
        "sticks": r.case.sticks,
        "posture": r.posture,
        "types": {name: r.urdf.joints[name].kind for name in r.bodies.joints},
        "mimic": [name for name in r.bodies.moving if name not in r.bodies.joints],
        "inertia": r.drives.inertia.tolist(),
        "coulomb": r.drives.coulomb.tolist(),
        "viscous": r.drives.viscous.tolist(),
        "k": r.drives.k.tolist(),
        "span": np.ptp(r.run.positions, axis=0).tolist(),
        "largest_command": np.abs(r.run.commands).max(axis=0).tolist(),
        "link_inertia": np.diag(r.bodies.mass_matrix(centre)).tolist(),
    }


def write_topics(path: Path, topics: list[Topic]) -> None:
    """A bare .mcap; messages are received a little after they were stamped."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    messages = []
    with Writer(path.with_suffix(""), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic in topics:
            kind = "sensor_msgs/msg/JointState" if topic.named else "std_msgs/msg/Float64MultiArray"
            connection = writer.add_connection(topic.name, kind, typestore=store)
            for k, time in enumerate(topic.times):
                stamp = START_NS + round(time * 1e9)
                made = _message(store, topic, kind, stamp, k)
                messages.append((stamp + RECEIVED, connection, store.serialize_cdr(made, kind)))
        for received, connection, data in sorted(messages, key=lambda message: message[0]):
            writer.write(connection, received, data)
    next(path.with_suffix("").glob("*.mcap")).rename(path)
    shutil.rmtree(path.with_suffix(""))


def _message(store: Any, topic: Topic, kind: str, stamp: int, k: int) -> Any:
    types: Mapping[str, Any] = store.types
    values = {field: np.ascontiguousarray(topic.fields[field][k]) for field in topic.fields}
    if not topic.named:
        layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        return types[kind](layout=layout, data=values["effort"])
    time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    header = types["std_msgs/msg/Header"](stamp=time, frame_id="")
    empty = np.array([], float)
    fields = {field: values.get(field, empty) for field in ("position", "velocity", "effort")}
    return types[kind](header=header, name=list(topic.names), **fields)
