# SPDX-License-Identifier: BSD-3-Clause
"""Rests of a robot from a bag, with the known loads of its topic /load (geometry_msgs/msg/WrenchStamped) or of a table.

A load is a force at the origin of the frame `header.frame_id`, in the axes of the world; it holds until the next one.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from jointscope.graphs.screening.mistaken_transmission import mistaken_transmission
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording
from jointscope.robots.rests.angle_units import check_angle_units
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.robots.rests.rests import Rests, find_rests
from jointscope.tools.bags.at_poses.load_table import check_loads, loads_beside, loads_from_table
from jointscope.tools.bags.errors_of import errors_of
from jointscope.tools.bags.load_topic import LOAD, LOAD_TYPE, load_messages
from jointscope.tools.bags.read_recording import read_recording


def read_rests(path: str | Path, robot: Robot) -> Rests:
    """Reads the rests of a bag.

    Args:
        path: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: says which topics, fields, units and joint names.

    Raises:
        RecordingError: the bag cannot be read, has no rests, positions in another unit than the robot file says, or
            loads that cannot hang on this robot.
    """
    robot.need_link_dynamics()
    with errors_of(path):
        recording = read_recording(path, robot)
    return rests_of(recording, robot)


def rests_of(recording: Recording, robot: Robot) -> Rests:
    """The rests of a recording, with the loads that its bag or the table beside it says.

    Args:
        recording: of a bag that is still there.
        robot: with equations of motion for its links.

    Raises:
        RecordingError: as of `read_rests`.
    """
    robot.need_link_dynamics()
    path = Path(recording.path)
    with errors_of(path):
        check_angle_units(recording, robot)
    mistake = mistaken_transmission(recording, robot)
    odd = () if mistake is None else (Notice("transmission", "info", 0, mistake.sentence(robot)),)
    table = loads_beside(path)
    found = _loads(path, robot, recording)
    if not table.is_file():
        rests = find_rests(recording, robot, found or LoadHistory.none())
        return replace(rests, notices=(*rests.notices, *odd))
    if found is not None:
        raise RecordingError(f"{path}: has the topic {LOAD}, and {table} says loads, too; remove the one that is wrong")
    _must_have_one_clock(path, recording)
    rests = find_rests(recording, robot, loads_from_table(table, robot, recording))
    told = Notice("load", "info", len(rests), f"Loads are those of {table}.")
    return replace(rests, notices=(*rests.notices, *odd, told))


def _loads(path: Path, robot: Robot, recording: Recording) -> LoadHistory | None:
    """All loads of a bag on the clock of its recording; None where it has no such topic.

    Raises:
        RecordingError: of another type, on a link that is not there, torques, or weights in grams.
    """
    said = load_messages(path)
    if said is None:
        return None
    kind, messages = said
    if kind != LOAD_TYPE:
        raise RecordingError(f"{path}: topic {LOAD}: expected {LOAD_TYPE}, got {kind}")
    _must_have_one_clock(path, recording)
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages], dtype=np.int64)
    forces = np.array([[m.wrench.force.x, m.wrench.force.y, m.wrench.force.z] for m in messages], dtype=float)
    torques = np.array([[m.wrench.torque.x, m.wrench.torque.y, m.wrench.torque.z] for m in messages], dtype=float)
    links = [str(m.header.frame_id) for m in messages]
    if np.any(torques != 0.0):
        raise RecordingError(
            f"{path}: topic {LOAD}: torques of up to {np.abs(torques).max():g} N m; expected forces alone, at "
            "the origin of the frame that header.frame_id names"
        )
    check_loads(f"{path}: topic {LOAD}", robot, forces, links, "header.frame_id")
    order = np.argsort(stamps, kind="stable")
    times = (stamps[order] - recording.start_ns) / 1e9
    found = LoadHistory(times, forces[order], tuple(links[i] for i in order))
    _must_be_of(path, recording, found)
    return found


def _must_be_of(path: Path, recording: Recording, loads: LoadHistory) -> None:
    """Loads change while their recording lasts; one that hangs there all the time may have been said before it."""
    last = float(max(stream.times[-1] for stream in recording.streams.values()))
    changes, late = loads.changes, loads.times[loads.times > last]
    before = bool(len(changes)) and bool(np.all(changes < 0.0))
    if not (before or len(late)):
        return
    where = f"all {len(changes)} changes of the load are" if before else f"{len(late)} loads are"
    off = f"up to {-changes[0]:.4g} s before it begins" if before else f"up to {late[-1] - last:.4g} s after its end"
    raise RecordingError(
        f"{path}: topic {LOAD}: by their header.stamp {where} {off}; expected stamps on the clock of the encoders, "
        f"from 0 to {last:.4g} s of this recording: check the clock of the node that says the loads"
    )


def _must_have_one_clock(path: Path, recording: Recording) -> None:
    if recording.shortened:
        raise RecordingError(
            f"{path}: has long pauses, so loads cannot be put on its clock; give each part as a bag of its own"
        )
