# SPDX-License-Identifier: BSD-3-Clause
"""Writes shaken poses: a bag of each, and excitation.yaml beside them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.files.sections.frequency_section import no_frequency
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.recordings.excitation_file import FILE
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.recordings.signals import Excitation, Signal, Signals
from jointscope.tools.bags.write_bag import joint_states, write_bag, write_topics
from jointscope.tools.writing.whole_file import whole_file

Array = NDArray[np.float64]
BEGIN = 1_700_000_000_000_000_000  # [ns] of the first stamp
COMMAND = "/motor_command"
FOREWORD = """\
# How the bags beside this file were excited. Torque of input i of n in experiment e, realisation r:
#   sign * sum_k amplitude[i] * cos(2 pi lines[k] f0 t + phases[r][i][k] + 2 pi i e / n)
# t counts from `start` of the experiment [s since the first stamp of the bag]; every period of 1 / f0 is steady.
"""


def write_shaken(
    folder: Path, robot: Robot, recordings: Sequence[tuple[str, Signals, Array]], excitation: Excitation, said: str
) -> list[Path]:
    """Writes the bags and the description of their excitation, and returns the paths of the bags.

    Args:
        folder: becomes one with a bag NAME.mcap for each recording.
        robot: with a section `frequency`, which says topics and units.
        recordings: name, torques of the motors that are shaken and positions of all joints, and the excitation alone.
        excitation: the same in all of them.
        said: more lines of the description.

    Raises:
        RobotError: the robot file does not say what is shaken, or names topics that cannot be written.
        RecordingError: a bag cannot be written.
    """
    setup = robot.frequency
    if setup is None:
        raise RobotError(no_frequency(robot))
    strange = next((t for t in (setup.torques, setup.positions) if not t.msgtype.endswith("JointState")), None)
    if strange is not None:
        raise RobotError(f"{robot.path.name}: frequency: {strange.msgtype} can be read, not written; name a JointState")
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, signals, command in recordings:
        stamps = np.rint(signals.outputs.times * 1e9).astype(np.int64) + BEGIN
        efforts = np.zeros((len(stamps), robot.n))
        efforts[:, [robot.joints.index(joint) for joint in signals.inputs.names]] = signals.inputs.values
        by_topic: dict[str, dict[str, Array]] = {}
        names: dict[str, tuple[str, ...]] = {}
        for topic, values in ((setup.torques, efforts), (setup.positions, signals.outputs.values)):
            by_topic.setdefault(topic.topic, {})[topic.field] = _in_unit(topic, values)
            names[topic.topic] = topic.names
        topics = [joint_states(topic, names[topic], stamps, fields) for topic, fields in by_topic.items()]
        topics.append(
            joint_states(COMMAND, _names_of(setup.torques, robot, signals.inputs), stamps, {"effort": command})
        )
        paths.append(folder / f"{name}.mcap")
        write_topics(paths[-1], topics)
    text = _description(excitation, [name for name, _, _ in recordings], recordings[0][1].outputs.step)
    _write_description(folder, FOREWORD + text + said)
    return paths


def write_described(
    folder: Path, robot: Robot, recordings: Sequence[tuple[str, Recording]], excitation: Excitation, said: str
) -> list[Path]:
    """Writes bags as the robot itself records them, and the description, which names inputs and outputs.

    Args:
        folder: becomes one with a bag NAME.mcap for each recording.
        robot: with commands and encoders, which are what goes in and what comes out.
        recordings: name and streams.
        excitation: the same in all of them.
        said: more lines of the description.

    Raises:
        RecordingError: a bag cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.mcap" for name, _ in recordings]
    for path, (_, recording) in zip(paths, recordings, strict=True):
        write_bag(path, recording, robot)
    step = float(np.median(np.diff(recordings[0][1].streams["command"].times)))
    signals = (
        f"inputs: {_signal(robot.command)}  # the whole command, with what holds the pose\n"
        f"held: true  # each command acts until the next one\noutputs: {_signal(robot.motor_encoder.source)}\n"
    )
    text = _description(excitation, [name for name, _ in recordings], step)
    _write_description(folder, FOREWORD + signals + text + said)
    return paths


def _signal(topic: Topic) -> str:
    return f"{topic.topic}:{topic.field}" + (f":{','.join(topic.names)}" if topic.names else "")


def _write_description(folder: Path, text: str) -> None:
    with whole_file(folder / FILE) as path:
        path.write_text(text, encoding="utf-8")


def _in_unit(topic: Topic, values: Array) -> Array:
    return np.asarray(values / topic.factor)


def _names_of(topic: Topic, robot: Robot, shaken: Signal) -> tuple[str, ...]:
    return tuple(topic.names[robot.joints.index(joint)] for joint in shaken.names)


def _description(excitation: Excitation, bags: Sequence[str], step: float) -> str:
    rows = [
        f"  - {{bag: {bag}, realisation: {e.realisation}, experiment: {e.number}, sign: {e.sign}, "
        f"start: {e.start:.9g}, periods: {e.periods}, transient: {e.transient}}}"
        for bag in bags
        for e in excitation.experiments
    ]
    lines = [
        f"f0: {excitation.f0:.12g}",
        f"sample_time: {step:.9g}",
        f"lines: {excitation.lines.tolist()}",
        *([f"reference: {{frequency: {excitation.carrier:.12g}}}"] if excitation.carrier else []),
        "experiments:",
        *rows,
    ]
    return "\n".join(lines) + "\n"
