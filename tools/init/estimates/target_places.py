# SPDX-License-Identifier: BSD-3-Clause
"""Targets that a tracker measures during motion: where tracker and target are, on the link that the user says.

No link is guessed: a topic with positions could be that of anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.joint_motion import joint_motion
from jointscope.robots.recordings.target_plausibility import fitted_tracker, seen_beside
from jointscope.robots.units import si_factor
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.bags.messages.open_bag import open_bag
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.init.estimates.open_target import held_parameters
from jointscope.tools.init.streams.sensor_noise import NoiseGuess, guess_noise

Array = NDArray[np.float64]

FIELDS = {
    "geometry_msgs/msg/PointStamped": "point",
    "geometry_msgs/msg/PoseStamped": "pose.position",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose.position",
    "geometry_msgs/msg/TransformStamped": "transform.translation",
}
"""Types of messages with a position, and the field that holds it."""
PLACE, TURN = 0.1, 0.2  # [m], [rad] by which places fitted without springs may be off
LARGEST = 5.0  # [m] a target that is farther from its link is in millimetres


@dataclass(frozen=True)
class GuessedTarget:
    """A target with the best place of its tracker.

    Attributes:
        sensor: as a robot file has it.
        noise: of one component, in the unit of the bag.
        left: what remains between measured and predicted positions, root mean square [m]; springs are not in it.
        held: parameters of which the motion tells nothing beside the others.
    """

    sensor: PositionTarget
    noise: NoiseGuess
    left: float
    held: tuple[str, ...] = ()


def position_topics(bag: Path) -> dict[str, str]:
    """Topics of a bag with positions of something, and their types."""
    with open_bag(bag) as opened:
        types = {topic: opened.type_names(topic) for topic in opened.topics}
    return {topic: names[0] for topic, names in types.items() if len(names) == 1 and names[0] in FIELDS}


def find_targets(bag: Path, robot: Robot, wanted: Sequence[str]) -> list[GuessedTarget]:
    """Targets on the links that the user says.

    Args:
        bag: the recording.
        robot: the robot without them.
        wanted: texts TOPIC=LINK.

    Raises:
        RobotError: a text of another form, no such topic of positions, or no such link.
        RecordingError: the recording cannot be read.
    """
    there, found = position_topics(bag), list[GuessedTarget]()
    for text in wanted:
        topic, mark, link = text.partition("=")
        if not mark or not link:
            raise RobotError(f"--target {text}: expected TOPIC=LINK, the link that carries the target")
        if topic not in there:
            known = f"{did_you_mean(topic, list(there))}" if there else "; the bag has none"
            raise RobotError(f"--target {text}: no topic {topic} with positions{known}")
        moving = [body for body in robot.tree.bodies if robot.tree.joints_below(body)]
        if link not in moving:
            raise RobotError(f"--target {text}: no link {link!r} that moves{did_you_mean(link, moving)}")
        taken = [*robot.sensors, *(target.sensor.name for target in found), "command", "motor", "robot", *robot.joints]
        found.append(_fitted(bag, robot, Topic(topic, there[topic], FIELDS[there[topic]], "m"), link, taken))
    return found


def _fitted(bag: Path, robot: Robot, source: Topic, link: str, taken: Sequence[str]) -> GuessedTarget:
    name = _name(source.topic, taken)
    sensor = PositionTarget(name, source, link, np.zeros(3), None, np.eye(4), name, 1e-3)
    recording = read_recording(bag, robot.with_sensors({name: sensor}))
    stream, encoder = recording.streams[name], robot.motor_encoder
    posed = robot.in_posture(recording.posture)
    motion = joint_motion(recording.streams[encoder.name], encoder.zero)
    motors, seen = seen_beside(motion, stream)
    q = joint_angles(posed, motors)
    for unit in ("m", "mm"):
        T, at, left = fitted_tracker(posed.tree, link, np.zeros(3), q, si_factor(unit) * seen)
        if np.linalg.norm(at) < LARGEST:
            break
    fitted = replace(sensor, source=replace(source, unit=unit), at=at, tracker_pose=T)
    noise = guess_noise(stream.times, stream.values, unit)
    sigma, priors = si_factor(unit) * noise.sigma, np.repeat([PLACE, PLACE, TURN], 3)
    return GuessedTarget(fitted, noise, left, held_parameters(posed.tree, fitted, q, sigma, priors))


def _name(topic: str, taken: Sequence[str]) -> str:
    """The last part of a topic that is no word for a position, as "marker3" of "/camera/marker3/pose"."""
    parts = [part for part in topic.replace("-", "_").split("/") if part]
    telling = [part for part in parts if part not in ("pose", "point", "position", "transform")] or parts
    name, number = telling[-1], 2
    while name in taken:
        name, number = f"{telling[-1]}_{number}", number + 1
    return name
