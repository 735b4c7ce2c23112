# SPDX-License-Identifier: BSD-3-Clause
"""An arm that was shaken in one pose, from a bag: torques of its motors, positions of all joints, the excitation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.files.sections.frequency_section import no_frequency
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.signals import Excitation, Signals
from jointscope.tools.bags.read_signals import excitation_of, read_signals


def read_shaken(path: Path, robot: Robot) -> tuple[Signals, Excitation]:
    """Torques of the motors that are shaken as inputs, positions of all joints as outputs, in SI units.

    Raises:
        RobotError: the robot file does not say what is shaken.
        RecordingError: the bag cannot be read, or shows no excitation.
    """
    setup = robot.frequency
    if setup is None:
        raise RobotError(no_frequency(robot))
    shaken = [robot.joints.index(joint) for joint in setup.joints]
    source, target = _spec(setup.torques, shaken), _spec(setup.positions, list(range(robot.n)))
    signals, drive = read_signals(path, source, target, led=True)
    inputs = replace(signals.inputs, values=signals.inputs.values * _of(setup.torques, shaken), names=setup.joints)
    outputs = replace(signals.outputs, values=signals.outputs.values * setup.positions.factor, names=robot.joints)
    signals = replace(signals, inputs=inputs, outputs=outputs)
    return signals, excitation_of(path, signals, drive)


def _spec(topic: Topic, places: list[int]) -> str:
    return f"{topic.topic}:{topic.field}:{','.join(topic.names[i] for i in places)}"


def _of(topic: Topic, places: list[int]) -> NDArray[np.float64]:
    """Factors to SI units of some joints."""
    return topic.factor if topic.factor.ndim == 0 else topic.factor[places]
