# SPDX-License-Identifier: BSD-3-Clause
"""Can this recording be a measurement of this robot? Errors for what cannot be, notices for what looks odd."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import init_command
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.encoder_gyro_scale import check_scales
from jointscope.robots.recordings.imu_plausibility import check_accelerometers, check_gyros
from jointscope.robots.recordings.joint_motion import JointMotion, joint_motion
from jointscope.robots.recordings.motor_zero import with_motor_zero
from jointscope.robots.recordings.recording import Notice, Recording, Stream
from jointscope.robots.recordings.resting_joints import (
    MOVED_ANGLE,
    joints_without_motion,
    what_it_cannot_tell,
)
from jointscope.robots.recordings.still_stretches import OFTEN, standing_share
from jointscope.robots.recordings.target_plausibility import check_targets
from jointscope.robots.recordings.wrapped_counter import wrapping_jump
from jointscope.robots.units import UNITS, of_slide, si_factor, si_unit

Array = NDArray[np.float64]

MIN_SECONDS = 0.3  # [s]
FROZEN_SAMPLES, FROZEN_SECONDS = 20, 0.1  # [1], [s] a gyro does not repeat itself that often by chance
FOLLOWED = 0.05  # of its range, by which a command moves what follows it
MIN_SAMPLES = 100  # of each sensor
BEYOND_LIMIT = 1.2  # times the robot's limit: odd
IMPOSSIBLE = 5.0  # times the robot's limit: wrong units
FEW_JOINTS = 2  # others that keep their limits are enough to say that it is this joint
DUTY_LIMIT = 1.0 + 1e-6
PERCENT = 100.0
OVER_VOLTAGE = 1.2  # times the supply
SAME = 1e-3  # [rad], [m] a position that the robot file has already


def screen(recording: Recording, robot: Robot) -> list[Notice]:
    """Screens a recording.

    Args:
        recording: what was measured.
        robot: what it was measured on.

    Returns:
        What looks odd.

    Raises:
        RecordingError: a stream is empty, too short, not finite, constant, outside the others' time or in the wrong
            unit, or nothing moves.
    """
    for stream in recording.streams.values():
        _check_samples(stream)
    for sensor in (robot.motor_encoder, robot.link_encoder):
        if sensor is not None:
            _check_wraps(recording.streams[sensor.name], sensor.units)
    recording = with_motor_zero(recording, robot)
    notices = [*about_bodies(recording, robot), *_check_overlap(recording)]
    robot = robot.in_posture(recording.posture)
    _check_command(recording.command, robot)
    turned = joint_motion(recording.streams[robot.motor_encoder.name], robot.motor_encoder.zero)
    motion = replace(turned, q=joint_angles(robot, turned.q), v=joint_angles(robot, turned.v))
    check_accelerometers(recording, robot)
    for name in robot.sensors:
        _check_changes(recording, recording.streams[name], robot)
    for biased in robot.biased:
        _check_frozen(recording.streams[biased.name])
    if robot.motor_current is not None:
        _check_frozen(recording.streams[robot.motor_current.name], recording.command)
    notices += _check_limits(motion, robot)
    notices += _check_motion(recording, robot)
    notices += check_targets(recording, robot, motion)
    odd = check_gyros(recording, robot, motion)
    return notices + odd + check_scales(recording, robot, suspected={notice.stream for notice in odd})


def _check_samples(stream: Stream) -> None:
    """Checks one stream by itself."""
    if not len(stream):
        raise RecordingError(f"{stream.name} is empty: it holds no sample")
    bad = ~np.isfinite(stream.values)
    for column, channel in zip(bad.T, stream.channels, strict=True):
        if column.any():
            first = stream.times[np.argmax(column)]
            raise RecordingError(
                f"{channel} holds {np.count_nonzero(column)} values that are not finite (NaN or infinite), the first "
                f"at {first:.3f} s; expected a number in every sample: check the field, or remove those messages"
            )
    if stream.name != "command" and len(stream) < MIN_SAMPLES:
        raise RecordingError(f"{stream.name} is too short: {len(stream)} samples; expected at least {MIN_SAMPLES}")


def _check_frozen(stream: Stream, command: Stream | None = None) -> None:
    """A sensor whose noise stops repeats its last sample: it or its driver has died.

    Args:
        stream: of the sensor.
        command: of what it follows, where it may well repeat itself as long as that stands; None where its noise never
            rests.
    """
    same = np.all(stream.values[1:] == stream.values[:-1], axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    starts, stops = edges[::2], edges[1::2]
    if command is not None:
        kept = [_moves(command, *stream.times[[start, stop]]) for start, stop in zip(starts, stops, strict=True)]
        starts, stops = starts[kept], stops[kept]
    if len(starts) == 0:
        return
    lengths = stops - starts
    longest = int(np.argmax(lengths))
    t0, t1 = float(stream.times[starts[longest]]), float(stream.times[stops[longest]])
    if lengths[longest] >= FROZEN_SAMPLES and t1 - t0 > FROZEN_SECONDS:
        raise RecordingError(
            f"{stream.name} repeats one sample from {t0:.3f} to {t1:.3f} s: the sensor has stopped; use the part of "
            "the recording before or after it"
            + ("" if command is None else f", or remove {stream.name} from the robot file")
        )


def _moves(command: Stream, t0: float, t1: float) -> bool:
    """Whether commands change clearly between two times [s]."""
    inside = command.values[(command.times >= t0) & (command.times <= t1)]
    return len(inside) > 0 and bool(np.any(np.ptp(inside, axis=0) > FOLLOWED * np.ptp(command.values, axis=0)))


def _check_wraps(stream: Stream, units: Sequence[str]) -> None:
    """A position does not cross its whole range between two samples; a counter that begins anew does."""
    for channel, column, unit in zip(stream.channels, stream.values.T, units, strict=True):
        jump = wrapping_jump(stream.times, column)
        if jump > 10.0 * MOVED_ANGLE:
            raise RecordingError(
                f"{channel} jumps by {jump:.4g} {unit} from one sample to the next, nearly its whole range: it looks "
                f"like a counter that begins anew; set `wraps` of sensors.{stream.name} in the robot file to its period"
            )


def _check_overlap(recording: Recording) -> list[Notice]:
    """All streams must show the same stretch of time; a command holds until the next one."""
    first = {name: float(s.times[0]) for name, s in recording.streams.items()}
    last = {name: float(s.times[-1]) for name, s in recording.streams.items()}
    late, early = max(first, key=first.__getitem__), min(last, key=last.__getitem__)
    common = last[early] - first[late]
    if common <= 0:
        raise RecordingError(
            f"{early} ends at {last[early]:.3f} s, before {late} begins at {first[late]:.3f} s; expected streams of "
            "the same stretch of time: check that both are stamped by the same clock"
        )
    if common < MIN_SECONDS:
        raise RecordingError(f"the recording is too short: {common:.3f} s; expected at least {MIN_SECONDS:g} s")
    whole = recording.duration
    if common < 0.95 * whole:
        text = f"all streams together cover only {common:.3f} of {whole:.3f} s: {late} begins late" + (
            " and ends early" if late == early else f" or {early} ends early"
        )
        return [Notice(late, "info", 0, text)]
    return []


def _check_command(command: Stream, robot: Robot) -> None:
    largest = np.abs(command.values).max(axis=0)
    if not largest.any():
        raise RecordingError("the command is zero in all samples; expected a robot that is driven: check the topic")
    channel, value = command.channels[int(np.argmax(largest))], float(largest.max())
    unit = robot.command.unit
    if unit == "duty" and value > DUTY_LIMIT:
        hint = "it looks like percent: divide by 100" if 2.0 < value <= PERCENT else "check `command.unit`"
        raise RecordingError(f"{channel} reaches {value:.4g}; expected a duty cycle from -1 to 1; {hint}")
    supply = robot.constants.get("motor.supply_voltage", np.inf)
    if unit == "V" and value > OVER_VOLTAGE * supply:
        raise RecordingError(
            f"{channel} reaches {value:.4g} V; the supply gives {supply:g} V; check `command.unit` or "
            "`motor.supply_voltage`"
        )


def _check_changes(recording: Recording, stream: Stream, robot: Robot) -> None:
    """No channel may be dead; a joint that nobody drives may stand still."""
    constant = np.ptp(stream.values, axis=0) == 0
    if stream.name == robot.motor_encoder.name:
        constant &= np.ptp(recording.command.values, axis=0) > 0
    units = robot.sensors[stream.name].units
    for dead, channel, unit, value in zip(constant, stream.channels, units, stream.values[0], strict=True):
        if dead:
            rests = "; the motors stand often: rests follow --rests"
            raise RecordingError(
                f"{channel} never changes: {value:.6g} {unit} in all {len(stream)} samples; expected at least "
                "noise: the sensor is dead or another field holds its values"
                + rests
                * (standing_share(recording, robot) > OFTEN)
            )


def _check_limits(motion: JointMotion, robot: Robot) -> list[Notice]:
    """Angles and speeds against the limits of the URDF: degrees instead of radians show here."""
    limits = robot.tree.limits
    notices = []
    for what, turning_unit, seen, allowed in (
        ("spans", "rad", np.ptp(motion.q, axis=0), limits[:, 1] - limits[:, 0]),
        ("moves at", "rad/s", np.abs(motion.v).max(axis=0), robot.tree.velocity_limits),
    ):
        share = seen / allowed
        k = int(np.argmax(share))
        channel, unit = f"{robot.joints[k]}.motor_position", robot.unit_at(robot.joints[k], turning_unit)
        text = f"{channel} {what} {seen[k]:.4g} {unit}; {robot.tree.urdf.name} allows {allowed[k]:.4g} {unit}"
        if share[k] > IMPOSSIBLE:
            others = [joint for j, joint in enumerate(robot.joints) if share[j] <= 1.0]
            if len(others) == robot.n - 1 >= FEW_JOINTS:
                raise RecordingError(f"{text}; {_one_joint_hint(robot, others)}")
            raise RecordingError(f"{text}; {_unit_hint(robot, k, float(share[k]))}")
        if share[k] > BEYOND_LIMIT:
            notices.append(Notice(robot.motor_encoder.name, "limit", 0, text))
    return notices


def _one_joint_hint(robot: Robot, others: list[str]) -> str:
    """What may be wrong where all other joints keep their limits."""
    encoder = robot.motor_encoder
    now = ", ".join(encoder.source.bag_units(robot.n))
    return (
        "all other joints keep theirs: look whether its samples jump, whether it alone has another unit (`unit: "
        f"[{now}]` of sensors.{encoder.name} has one for each joint), or whether the URDF allows it too little; "
        f"without it: {init_command(robot, 'BAG', 'without', joints=others)}"
    )


def _unit_hint(robot: Robot, joint: int, excess: float) -> str:
    """Which unit would bring the positions of a joint back to what is allowed."""
    encoder = robot.motor_encoder
    now = encoder.source.bag_units(robot.n)[joint]
    place = f"`unit` of sensors.{encoder.name} in the robot file (now {now})"
    for unit in UNITS:
        if si_unit(unit) == si_unit(now) and excess * si_factor(unit) / si_factor(now) <= BEYOND_LIMIT:
            word = {"deg": "degrees", "rad": "radians"}.get(unit, unit)
            return f"the {'angles' if si_unit(now) == 'rad' else 'positions'} look like {word}: set {place} to {unit}"
    if si_unit(now) == "rad":
        return f"check {place}; counts of an encoder are `unit: rad` with `scale: [6.2832/COUNTS_PER_TURN, ...]`"
    return f"check {place}"


def _check_motion(recording: Recording, robot: Robot) -> list[Notice]:
    resting = joints_without_motion(recording, robot)
    if not resting:
        return []
    if len(resting) == robot.n:
        raise RecordingError("no joint moves in this recording; expected motion: nothing can be learned from rest")
    text = what_it_cannot_tell(robot, resting)
    return [Notice(robot.motor_encoder.name, "info", len(resting), text)]


def about_bodies(recording: Recording, robot: Robot) -> list[Notice]:
    """Where other joints are held, if the robot file does not say so, and remarks on inertias.

    Args:
        recording: what was measured.
        robot: as its file has it.
    """
    tree, name = (robot.as_filed or robot.tree), robot.motor_encoder.name
    notices = [Notice(name, "info", 0, remark) for remark in tree.remarks]
    held = tree.posture(recording.posture)
    new = {joint: at for joint, at in held.items() if not abs(tree.locked.get(joint, 0.0) - at) < SAME}
    if new:
        places = ", ".join(f"{at:.4g} {_unit(robot, joint)}" for joint, at in new.items())
        verb = "is" if len(new) == 1 else "are"
        text = f"{', '.join(new)} {verb} not moved: held at {places} as in the recording"
        filed = [f"{joint} at {tree.locked[joint]:.4g} {_unit(robot, joint)}" for joint in new if joint in tree.locked]
        text += f" (the robot file locks {', '.join(filed)})" if filed else ""
        notices.append(Notice(name, "info", len(new), text))
    return notices


def _unit(robot: Robot, joint: str) -> str:
    return of_slide("rad") if robot.tree.is_slide(joint) else "rad"
