# SPDX-License-Identifier: BSD-3-Clause
"""Rests of a robot from a bag, with the known loads of its topic /load (geometry_msgs/msg/WrenchStamped).

A load is a force at the origin of the frame `header.frame_id`, in the axes of the world; it holds until the next one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.robots.rests.rests import Rests, find_rests
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.bags.messages.open_bag import open_bag
from jointscope.tools.bags.read_recording import read_recording

LOAD = "/load"
LOAD_TYPE = "geometry_msgs/msg/WrenchStamped"
HEAVY = 3.0  # times what the robot weighs: no arm holds that


def read_rests(path: str | Path, robot: Robot) -> Rests:
    """Reads the rests of a bag.

    Args:
        path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: says which topics, fields, units and joint names.

    Raises:
        RecordingError: the bag cannot be read, has no rests, or loads that cannot hang on this robot.
    """
    robot.need_link_dynamics()
    recording = read_recording(path, robot)
    return find_rests(recording, robot, _loads(Path(path), robot, recording.start_ns, recording.shortened))


def _loads(path: Path, robot: Robot, start_ns: int, shortened: bool) -> LoadHistory:
    """All loads of a bag on the clock of its recording.

    Raises:
        RecordingError: of another type, on a link that is not there, torques, or weights in grams.
    """
    with open_bag(path) as bag:
        if LOAD not in bag.topics:
            return LoadHistory.none()
        kind = bag.message_type(LOAD)
        if kind.name != LOAD_TYPE:
            raise RecordingError(f"{path}: topic {LOAD}: expected {LOAD_TYPE}, got {kind.name}")
        messages = [kind.decode(raw) for raw in bag.read([LOAD])[LOAD].data]
    if shortened:
        raise RecordingError(
            f"{path}: has long pauses, so loads cannot be put on its clock; give each part as a bag of its own"
        )
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages], dtype=np.int64)
    forces = np.array([[m.wrench.force.x, m.wrench.force.y, m.wrench.force.z] for m in messages], dtype=float)
    torques = np.array([[m.wrench.torque.x, m.wrench.torque.y, m.wrench.torque.z] for m in messages], dtype=float)
    links = [str(m.header.frame_id) for m in messages]
    check_loads(path, robot, forces, torques, links)
    order = np.argsort(stamps, kind="stable")
    times = (stamps[order] - start_ns) / 1e9
    return LoadHistory(times, forces[order], tuple(links[i] for i in order))


def check_loads(path: Path, robot: Robot, forces: np.ndarray, torques: np.ndarray, links: list[str]) -> None:
    """Loads that can hang on a robot.

    Raises:
        RecordingError: no numbers, torques, links that are not there, weights in grams.
    """
    if not np.all(np.isfinite(forces)):
        raise RecordingError(f"{path}: topic {LOAD}: a force is no number; remove these messages")
    if np.any(torques != 0.0):
        raise RecordingError(
            f"{path}: topic {LOAD}: torques of up to {np.abs(torques).max():g} N m; expected forces alone, at "
            "the origin of the frame that header.frame_id names"
        )
    for link in dict.fromkeys(links):
        if link not in robot.tree.bodies:
            hint = did_you_mean(link, robot.tree.bodies)
            raise RecordingError(
                f"{path}: topic {LOAD}: no link {link!r} in {robot.tree.urdf.name}{hint}; "
                "header.frame_id names the link at whose origin the force acts"
            )
    weight = sum(inertia.mass for inertia in robot.tree.model.inertias) * float(np.linalg.norm(robot.tree.gravity))
    largest = float(np.linalg.norm(forces, axis=1).max(initial=0.0))
    if 0.0 < HEAVY * weight < largest:
        raise RecordingError(
            f"{path}: topic {LOAD}: a force of {largest:.4g} N on a robot that weighs {weight:.3g} N; expected newton: "
            "kilograms times 9.81, grams times 0.00981"
        )
