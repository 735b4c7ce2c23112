# SPDX-License-Identifier: BSD-3-Clause
"""Which signal drives the motors, which ones measure them: by type, by name, by whether it moves.

Every choice keeps its reason, for the user to agree or not.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.wrapped_counter import continued, wrapping_jump
from jointscope.tools.robot_guess.signals import Signal

COMMAND = re.compile(r"command|cmd|desired|target|setpoint|reference|goal")
LINK_SIDE = re.compile(r"link|load|output|secondary|arm_side|absolute")
IMU = "sensor_msgs/msg/Imu"
TURNS = (2.0 * np.pi, 360.0, 1.0)  # periods of counters, in rad, degrees, turns
NEAR_A_TURN = 0.1  # relative; the joint moves on while its counter jumps


@dataclass(frozen=True)
class Chosen:
    """A signal in its role.

    Attributes:
        signal: where it is.
        names: joint names in the messages, one per joint of the robot; empty where the messages name none.
        reason: why this one.
        sure: whether nothing else could be meant.
        wraps: period after which its counter begins anew, in the unit of the bag; the signal is continued already.
    """

    signal: Signal
    names: tuple[str, ...]
    reason: str
    sure: bool
    wraps: float = 0.0


@dataclass(frozen=True)
class Roles:
    """Who is who.

    Attributes:
        joints: joints of the URDF that the bag shows, base to tip.
        motor_encoder, command: as a robot file needs them.
        link_encoder, joint_torque: where there are any.
        imus: gyroscopes, in the order of the bag.
    """

    joints: tuple[str, ...]
    motor_encoder: Chosen
    command: Chosen
    link_encoder: Chosen | None
    joint_torque: Chosen | None
    imus: tuple[Signal, ...]


def assign_roles(signals: list[Signal], urdf_joints: tuple[str, ...], wanted: tuple[str, ...] = ()) -> Roles:
    """Gives every role its signal.

    Args:
        signals: of the bag.
        urdf_joints: moving joints of the URDF, base to tip.
        wanted: joints that the user named; those that the bag shows moving if empty.

    Raises:
        RecordingError: no positions, no joints of the URDF, or nothing that drives the motors.
    """
    positions = [s for s in signals if s.field == "position" and not COMMAND.search(s.topic.lower())]
    if not positions:
        raise RecordingError("the bag holds no joint positions (sensor_msgs/msg/JointState besides commands)")
    motor_side = [s for s in positions if not LINK_SIDE.search(s.topic.lower())]
    link_side = [s for s in positions if LINK_SIDE.search(s.topic.lower())]
    # encoders whose topics say nothing else sit on the motors
    motors = (motor_side or positions)[0]
    joints, names = _joints(motors, link_side, urdf_joints, wanted)
    rivals = [s.topic for s in motor_side[1:]]
    reason = f"also there: {', '.join(rivals)}" if rivals else "the positions that are not those of links or commands"
    encoder = _encoder(motors, names, joints, reason, sure=not rivals)
    links = next((s for s in link_side if s is not motors and s.moving(names)), None)
    said = "its topic speaks of links or loads"
    link = None if links is None else _encoder(links, names, joints, said, sure=False)
    torque = next((s for s in signals if s.field == "effort" and links and s.topic == links.topic), None)
    return Roles(
        joints=joints,
        motor_encoder=encoder,
        command=_drive(signals, motors, names),
        link_encoder=link,
        joint_torque=_torque(torque, names),
        imus=tuple(s for s in signals if s.msgtype == IMU),
    )


def _encoder(signal: Signal, names: tuple[str, ...], joints: tuple[str, ...], reason: str, sure: bool) -> Chosen:
    """An encoder; one whose counter begins anew after a turn is continued."""
    columns = signal.columns(names or joints)
    jump = max(wrapping_jump(signal.times, column) for column in columns.T)
    turn = next((turn for turn in TURNS if abs(jump / turn - 1.0) < NEAR_A_TURN), 0.0)
    if turn:
        signal = replace(signal, values=continued(signal.values, turn))
    return Chosen(signal, names, reason, sure, turn)


def _joints(
    motors: Signal, link_side: list[Signal], urdf_joints: tuple[str, ...], wanted: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Joints of the robot and their names in the messages."""
    unknown = [name for name in wanted if name not in urdf_joints]
    if unknown:
        raise RecordingError(f"--joints: the URDF has no moving joint {unknown[0]!r}; it has {', '.join(urdf_joints)}")
    candidates = tuple(name for name in urdf_joints if not wanted or name in wanted)
    if not motors.names:
        if motors.values.shape[1] != len(candidates):
            raise RecordingError(
                f"{motors.topic} names no joints and has {motors.values.shape[1]} columns for {len(candidates)} joints "
                f"of the URDF ({', '.join(candidates)}); choose them with --joints"
            )
        return candidates, ()
    shown = tuple(name for name in candidates if name in motors.names)
    if not shown and len(motors.names) == len(candidates):
        return candidates, motors.names  # other names, as many: in the same order
    if not shown:
        raise RecordingError(
            f"{motors.topic} names {', '.join(motors.names)}, the URDF has {', '.join(candidates)}: none in common; "
            "rename one of them, or choose as many joints as the bag has with --joints"
        )
    # encoders on links may be fewer than motors; without them those joints show nothing of their transmission
    seen = [s for s in link_side if s.names]
    with_links = tuple(name for name in shown if any(s.moving((name,)) for s in seen))
    kept = with_links if with_links and not wanted else shown
    return kept, kept


def _drive(signals: list[Signal], motors: Signal, names: tuple[str, ...]) -> Chosen:
    """What acts on the motors: a commanded effort, else one that was measured."""
    efforts = [s for s in signals if s.field == "effort" and s.moving(names)]
    commanded = [s for s in efforts if COMMAND.search(s.topic.lower())]
    if commanded:
        return Chosen(commanded[0], names, "its topic speaks of commands", sure=len(commanded) == 1)
    measured = [s for s in efforts if s.topic == motors.topic]
    if measured:
        reason = "no effort was commanded: the effort that the motors report drives the model"
        return Chosen(measured[0], names, reason, sure=False)
    arrays = [s for s in signals if s.field == "data" and s.values.shape[1] == len(names or motors.values[0])]
    named = [s for s in arrays if COMMAND.search(s.topic.lower()) or "effort" in s.topic.lower()]
    if named:
        return Chosen(named[0], (), "an array with one value per joint, named like a command", sure=False)
    raise RecordingError(
        "nothing in the bag drives the motors: no effort on a command topic nor with the joint positions; record the "
        "duty cycle, voltage or torque (JointState.effort) beside the positions"
    )


def _torque(signal: Signal | None, names: tuple[str, ...]) -> Chosen | None:
    if signal is None or not signal.moving(names):
        return None
    return Chosen(signal, names, "efforts beside the positions of the links", sure=False)
