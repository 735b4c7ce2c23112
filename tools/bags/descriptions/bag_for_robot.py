# SPDX-License-Identifier: BSD-3-Clause
"""How a bag that was described fits a robot: what the robot needs, and whether its recording can be used."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from jointscope.graphs.screening.screen_all import screen_all
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.resting_joints import must_move
from jointscope.robots.units import joined
from jointscope.tools.bags.at_poses.read_rests import rests_of
from jointscope.tools.bags.descriptions.bag_description import BagDescription, NeedDescription, TopicDescription
from jointscope.tools.bags.load_topic import largest_load
from jointscope.tools.bags.messages.open_bag import Bag
from jointscope.tools.bags.needed_streams import check_topic, full_type_name, needed_streams
from jointscope.tools.bags.read_motion import rests_in
from jointscope.tools.bags.read_recording import read_recording


def for_robot(described: BagDescription, bag: Bag, robot: Robot) -> BagDescription:
    """The description with what a robot needs of the bag.

    Args:
        described: the bag alone.
        bag: the same, open.
        robot: what to compare it with.
    """
    needs = _needs(bag, robot, {topic.topic: topic for topic in described.topics})
    problem, notices, of_rests = _judge(described.path, robot, needs)
    return replace(
        described,
        robot=robot.name,
        needs=needs,
        usable=problem is None,
        problem=problem,
        notices=notices,
        rests=of_rests,
        transmission=_transmission(robot),
    )


def _transmission(robot: Robot) -> tuple[tuple[float, ...], ...] | None:
    """Joint angles per motor angle; None where every motor moves its own joint alone."""
    T = joint_angles(robot, np.eye(robot.n)).T
    return None if np.array_equal(T, np.eye(robot.n)) else tuple(map(tuple, T.tolist()))


def _needs(bag: Bag, robot: Robot, topics: dict[str, TopicDescription]) -> tuple[NeedDescription, ...]:
    needs = []
    for need in needed_streams(robot):
        source = need.source
        msgtype = full_type_name(source.msgtype)
        problem = None
        try:
            check_topic(bag, source)
            names = topics[source.topic].names if source.topic in topics else ()
            missing = [name for name in source.names if names and name not in names]
            if missing:
                problem = f"no joint {missing[0]!r} on {source.topic}, which names {', '.join(names)}"
        except RecordingError as err:
            problem = str(err)
        candidates = tuple(topic for topic in bag.topics if bag.type_names(topic) == (msgtype,))
        needs.append(
            NeedDescription(
                need.name,
                source.topic,
                msgtype,
                source.field,
                joined(source.bag_units(1)),
                problem,
                candidates,
            )
        )
    return tuple(needs)


def _judge(
    path: str, robot: Robot, needs: tuple[NeedDescription, ...]
) -> tuple[str | None, tuple[str, ...], int | None]:
    """Why the recording cannot be used for a robot, what was odd, and how many rests it has if it is one of these."""
    missing = [need.stream for need in needs if need.problem is not None]
    if missing:
        return f"{', '.join(missing)} cannot be read", (), None
    try:
        recording = read_recording(path, robot)
        if largest_load(Path(path)) > 0.0 or rests_in(recording, robot)[1]:
            rests = rests_of(recording, robot)
            return None, tuple(notice.text for notice in rests.notices), len(rests)
    except RecordingError as err:
        return str(err), (), None
    notices = recording.notices
    try:
        notices = [*notices, *screen_all(recording, robot)]
        problem = None
        must_move(robot, [recording])
    except RecordingError as err:
        problem = str(err)
    return problem, tuple(notice.text for notice in notices), None
