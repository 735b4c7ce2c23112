# SPDX-License-Identifier: BSD-3-Clause
"""What a caller may give: robots and recordings by name, path, object, or with the result that holds them; limits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from pathlib import Path

from jointscope.graphs.across_kinds.discover_kinds import KindsDiscovery
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.acceptance.limits import Limit, check_units, read_limits
from jointscope.tools.bags.read_motion import read_motion
from jointscope.tools.presentation.left_out import leave_out as leave_out_texts
from jointscope.tools.simulator.simulation import Simulation

AnyRobot = Robot | CalibrationResult | Discovery | KindsDiscovery | str | Path
AnyRecording = Recording | Simulation | str | Path
AnyStretches = Sequence[tuple[float, float] | str]
AnyLimits = str | Path | Sequence[Limit]


def robot_of(robot: AnyRobot) -> Robot:
    """The robot itself.

    Raises:
        RobotError: there is none of that name, or its file has a mistake.
    """
    if isinstance(robot, CalibrationResult | Discovery | KindsDiscovery):
        return robot.robot
    if not isinstance(robot, Robot | str | Path):
        raise RobotError(f"expected a robot, a result that has one, a name or a path, got {_told(robot)}")
    return robot if isinstance(robot, Robot) else load_robot(robot)


def recording_of(recording: AnyRecording, robot: Robot) -> Recording:
    """One recording.

    Raises:
        RecordingError: a bag cannot be read, or something is no recording.
    """
    if isinstance(recording, str | Path):
        return read_motion(recording, robot)
    given = recording.recording if isinstance(recording, Simulation) else recording
    if not isinstance(given, Recording):
        raise RecordingError(f"expected a recording, the result of simulate, or a path, got {_told(recording)}")
    for name, sensor in robot.sensors.items():
        channels = given.streams[name].channels if name in given.streams else sensor.channels
        if len(channels) != len(sensor.channels):
            raise RecordingError(
                f"the recording is of another robot than {robot.name}: its {name} has {', '.join(channels)}; expected "
                f"{', '.join(sensor.channels)}"
            )
    return given


def recordings_of(recordings: AnyRecording | Sequence[AnyRecording], robot: Robot) -> list[Recording]:
    """One or several recordings as a list.

    Raises:
        RecordingError: none is given, or a bag cannot be read.
    """
    several = recordings if isinstance(recordings, Sequence) and not isinstance(recordings, str) else [recordings]
    if not several:
        raise RecordingError("no recording is given; expected a path, a recording, or a list of them")
    return [recording_of(each, robot) for each in several]


def to_learn_from(
    robot: AnyRobot,
    recordings: AnyRecording | Sequence[AnyRecording],
    holdout: AnyRecording | None,
    leave_out: AnyStretches = (),
) -> tuple[Robot, list[Recording], Recording | None]:
    """The robot, what is learnt from, and what is held out.

    Raises:
        RecordingError: the held-out recording is also learnt from.
    """
    model = robot_of(robot)
    learnt = recordings_of(recordings, model)
    held = None if holdout is None else recording_of(holdout, model)
    if held is not None and any(held.shares_samples_with(recording) for recording in learnt):
        raise RecordingError(f"{held.path} is held out and also learnt from; hold out one that the model has not seen")
    both = without_stretches([*learnt, *([] if held is None else [held])], leave_out)
    return model, both[: len(learnt)], None if held is None else both[-1]


def without_stretches(recordings: Sequence[Recording], leave_out: AnyStretches) -> list[Recording]:
    """Recordings of which stretches are left out, as by --leave-out.

    Args:
        recordings: that were read.
        leave_out: (t0, t1) [s] where there is one recording, or texts "[BAG:]T0:T1".

    Raises:
        RecordingError: a stretch is none, or is meant for none or several of the recordings.
    """
    texts = []
    if not isinstance(leave_out, Sequence):
        raise RecordingError(f"leave_out: expected a list of (t0, t1) [s] or 'BAG:T0:T1', got {_told(leave_out)}")
    for stretch in leave_out:
        times = stretch if isinstance(stretch, Sequence) else ()
        if not isinstance(stretch, str) and not (len(times) == 2 and all(isinstance(t, Real) for t in times)):
            raise RecordingError(f"leave_out: expected (t0, t1) [s] or 'BAG:T0:T1', got {_told(stretch)}")
        texts.append(stretch if isinstance(stretch, str) else f"{float(stretch[0])!r}:{float(stretch[1])!r}")
    return leave_out_texts(recordings, texts)


def labelled(robots: AnyRobot | Sequence[AnyRobot] | Mapping[str, AnyRobot]) -> dict[str, Robot]:
    """One or several robots by their labels; those without one are called by their names or files.

    Raises:
        RobotError: none is given, or two have one name.
    """
    several = robots if isinstance(robots, Mapping | Sequence) and not isinstance(robots, str) else [robots]
    if not several:
        raise RobotError("no robot is given; expected one, a list of them, or a dict of labels and robots")
    if isinstance(several, Mapping):
        return {label: robot_of(robot) for label, robot in several.items()}
    labels = [Path(robot).stem if isinstance(robot, str | Path) else robot_of(robot).name for robot in several]
    if len(set(labels)) < len(labels):
        raise RobotError(f"{', '.join(labels)}: two models have one name; give labels: {{'before': ..., 'after': ...}}")
    return dict(zip(labels, map(robot_of, several), strict=True))


def _told(thing: object) -> str:
    return f"{type(thing).__name__} {thing!r}" if isinstance(thing, int | float | str) else type(thing).__name__


def limits_of(limits: AnyLimits, robots: Iterable[Robot]) -> tuple[Limit, ...]:
    """The lines of a file of limits, or those given.

    Raises:
        RobotError: the file has a mistake, or a bound is in another unit than what it limits.
    """
    if isinstance(limits, str | Path):
        limits = read_limits(Path(limits))
    for line in limits if isinstance(limits, Sequence) else (limits,):
        if not isinstance(line, Limit):
            raise RobotError(f"accept: expected the path of a file of limits, or a list of Limit, got {_told(line)}")
    check_units(limits, robots)
    return tuple(limits)
