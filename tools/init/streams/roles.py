# SPDX-License-Identifier: BSD-3-Clause
"""Which signal drives the motors, which ones measure them: by type, by name, by whether it moves.

The joints of the robot are those that move and are driven. Every choice keeps its reason, for the user to agree or not.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.screening import MIN_SAMPLES
from jointscope.tools.init.streams.efforts import effort_beside, torque_behind
from jointscope.tools.init.streams.joint_topics import DRIVEN
from jointscope.tools.init.streams.known_fields import IMU
from jointscope.tools.init.streams.named_signal import Chosen, NamedSignal, Wish, are_goals, by_place, named_signal
from jointscope.tools.init.streams.signals import Signal, complain_of_lengths
from jointscope.tools.init.streams.standing import Stance, stances

LINK_SIDE = re.compile(r"link|load|output|secondary|arm_side|absolute")


@dataclass(frozen=True)
class Roles:
    """Who is who.

    Attributes:
        joints: joints of the URDF that the bag shows moving and driven, base to tip.
        motor_encoder, command: as a robot file needs them.
        link_encoder, joint_torque: where there are any.
        imus: gyroscopes, in the order of the bag.
        stances: joints of the URDF that the bag knows, and whether they move.
        driven: joints whose command or measured effort varies.
        motor_effort: what motors report beside their positions, where something else drives them.
        no_number: joints whose positions are no numbers in most messages.
    """

    joints: tuple[str, ...]
    motor_encoder: Chosen
    command: Chosen
    link_encoder: Chosen | None
    joint_torque: Chosen | None
    imus: tuple[Signal, ...]
    stances: Mapping[str, Stance] = field(default_factory=dict)
    driven: tuple[str, ...] = ()
    motor_effort: Chosen | None = None
    no_number: tuple[str, ...] = ()


def assign_roles(
    signals: list[Signal],
    urdf_joints: tuple[str, ...],
    slides: Sequence[str] = (),
    wish: Wish | None = None,
    linked: bool = False,
) -> Roles:
    """Gives every role its signal.

    Args:
        signals: of the bag.
        urdf_joints: moving joints of the URDF, base to tip.
        slides: those of them that are prismatic.
        wish: what the user said.
        linked: without masses, joints that have no encoder on their link show nothing of their transmission; those
            that have one are the robot's, if there are any.

    Raises:
        RecordingError: no positions, no joints of the URDF, nothing that moves, or nothing that drives the motors.
    """
    wish = wish or Wish()
    _check_wish(wish, urdf_joints)
    positions = [s for s in signals if s.quantity == "position" and not s.commanded]
    if not positions:
        complain_of_lengths(signals, ("position",))
        raise RecordingError(
            "the bag holds no joint positions; expected sensor_msgs/msg/JointState.position or the state of a "
            "controller, besides commands"
        )
    named = [named_signal(s, urdf_joints, wish) for s in positions]
    link_side = [n for n in named if LINK_SIDE.search(n.signal.topic.lower())]
    # encoders whose topics say nothing else sit on the motors
    candidates = [n for n in named if n not in link_side] or named
    seen = [_stances(n, slides) for n in candidates]
    best = max(range(len(candidates)), key=lambda k: (_count(seen[k]), -k))
    motors, stance = candidates[best], {joint: s for found in (*seen[::-1], seen[best]) for joint, s in found.items()}
    _need_joints(motors, urdf_joints, stance)
    drive, reason, sure = _drive(signals, motors, urdf_joints, stance, wish)
    joints = _joints(motors, drive, stance, urdf_joints, wish)
    if linked and not wish.joints:
        seen_twice = [joint for joint in joints if any(n.varies(joint) for n in link_side if n is not motors)]
        joints = tuple(seen_twice) or joints
    rivals = [n.signal.topic for k, n in enumerate(candidates) if k != best]
    encoder = _encoder(motors, joints, _why(rivals), sure=not rivals)
    links = next((n for n in link_side if n is not motors and all(n.varies(joint) for joint in joints)), None)
    link = None if links is None else _encoder(links, joints, "its topic speaks of links or loads", sure=False)
    return Roles(
        joints=joints,
        motor_encoder=encoder,
        command=drive.chosen(joints, reason, sure),
        link_encoder=link,
        joint_torque=torque_behind(signals, link_side, urdf_joints, wish, joints),
        motor_effort=effort_beside(signals, motors, drive, urdf_joints, wish, joints),
        imus=tuple(s for s in signals if s.msgtype == IMU and s.quantity == "rate"),
        stances=stance,
        driven=tuple(joint for joint in urdf_joints if drive.varies(joint)),
        no_number=tuple(joint for joint in urdf_joints if joint in motors.names and joint not in stance),
    )


def _check_wish(wish: Wish, urdf_joints: tuple[str, ...]) -> None:
    for option, names in (("--joints", wish.joints), ("--lock", wish.locked)):
        unknown = [name for name in names if name not in urdf_joints]
        if unknown:
            raise RecordingError(
                f"{option}: the URDF has no moving joint {unknown[0]!r}; it has {', '.join(urdf_joints)}"
            )
    for option, names in (("--joints", wish.joints), ("--lock", wish.locked)):
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            raise RecordingError(f"{option} names {twice} twice; expected every joint once")
    both = [name for name in wish.locked if name in wish.joints]
    if both:
        raise RecordingError(f"{both[0]} stands under --joints and under --lock; expected one of them")


def _stances(named: NamedSignal, slides: Sequence[str]) -> dict[str, Stance]:
    """How the joints of a position signal behave."""
    joints = {name: joint for joint, name in named.names.items()}
    found = stances(named.signal, tuple(joints), [joint in slides for joint in joints.values()])
    return {joints[name]: stance for name, stance in found.items()}


def _count(stance: Mapping[str, Stance]) -> tuple[int, int]:
    return sum(s.moves for s in stance.values()), len(stance)


def _why(rivals: Sequence[str]) -> str:
    return f"also there: {', '.join(rivals)}" if rivals else "the positions that are not those of links or commands"


def _need_joints(motors: NamedSignal, urdf_joints: tuple[str, ...], stance: Mapping[str, Stance]) -> None:
    """Complains where the positions belong to no joint of the URDF, or none of them moves.

    Raises:
        RecordingError: it is so.
    """
    signal = motors.signal
    if motors.unclear:
        raise RecordingError(motors.unclear)
    if len(signal.times) < MIN_SAMPLES:
        raise RecordingError(
            f"{signal.topic} is too short: {len(signal.times)} positions; expected at least {MIN_SAMPLES}"
        )
    if not motors.names and signal.names:
        raise RecordingError(
            f"{signal.topic} names {', '.join(signal.names)}, the URDF has {', '.join(urdf_joints)}: none in common; "
            "say who is who, as in --joints "
            + ",".join(f"{j}={n}" for j, n in zip(urdf_joints, signal.names, strict=False))
        )
    if not motors.names:
        width = signal.values.shape[1]
        alone = "; topics of one joint each are put together where messages name the joint: let the driver fill `name`"
        choice = f"choose {width} of them with --joints{alone if width == 1 else ''}"
        raise RecordingError(
            f"{signal.topic} names no joints and has {width} columns for {len(urdf_joints)} joints of the URDF "
            f"({', '.join(urdf_joints)}); {choice}"
        )
    if not any(s.moves for s in stance.values()):
        spans = ", ".join(f"{joint} {s.span:.2g}" for joint, s in stance.items())
        raise RecordingError(
            f"no joint moves in the recording (they span {spans} in the unit of the bag); record a motion of the "
            "joints that shall be calibrated"
        )


def _joints(
    motors: NamedSignal,
    drive: NamedSignal,
    stance: Mapping[str, Stance],
    urdf_joints: tuple[str, ...],
    wish: Wish,
) -> tuple[str, ...]:
    """Joints of the robot: those that move and are driven, or those of them that the user named."""
    here = [joint for joint in urdf_joints if joint in motors.names and joint in stance and joint not in wish.locked]
    missing = [joint for joint in wish.joints if joint not in here]
    if missing:
        raise RecordingError(
            f"--joints: {motors.signal.topic} has no positions of {missing[0]}; it names "
            f"{', '.join(motors.names.values())}"
        )
    idle = [joint for joint in wish.joints if stance[joint].moves and not drive.varies(joint)]
    if idle:
        raise RecordingError(
            f"--joints: nothing drives {', '.join(idle)}: {drive.signal.topic} has no varying command for it; leave it "
            "out, or hold it at its mean with --lock"
        )
    driven = [joint for joint in here if stance[joint].moves and drive.varies(joint)]
    if wish.locked and not driven:
        raise RecordingError(
            f"--lock {','.join(wish.locked)} leaves no joint that moves and is driven; expected one at least: "
            f"name fewer under --lock"
        )
    if wish.joints:
        found = tuple(joint for joint in driven if joint in wish.joints)
        if not found:
            raise RecordingError(f"--joints: {', '.join(wish.joints)} stand still in the recording; expected motion")
        return found
    return tuple(driven)


def _encoder(named: NamedSignal, joints: tuple[str, ...], reason: str, sure: bool) -> Chosen:
    """An encoder; one that has no names is a guess, too."""
    chosen = named.chosen(joints, reason, sure)
    if named.signal.names:
        return chosen
    return replace(chosen, reason=f"{reason}; its columns are taken in the order of the URDF", sure=False)


def _drive(
    signals: list[Signal], motors: NamedSignal, urdf_joints: tuple[str, ...], stance: Mapping[str, Stance], wish: Wish
) -> tuple[NamedSignal, str, bool]:
    """What acts on the motors, why, and whether nothing else could: a commanded effort, else a measured one.

    Raises:
        RecordingError: there is none, or it is not clear whom it drives.
    """
    moving = tuple(joint for joint in urdf_joints if joint in stance and stance[joint].moves)
    efforts = [s for s in signals if s.quantity == "effort"]
    commanded = [s for s in efforts if s.commanded]
    measured = [s for s in efforts if not s.commanded and not LINK_SIDE.search(s.topic.lower())]
    beside = [s for s in measured if s.topic == motors.signal.topic]
    arrays = [s for s in signals if s.quantity == "numbers" and (s.commanded or DRIVEN.search(s.topic.lower()))]
    ways = (
        (commanded, "its topic or field speaks of commands", True),
        (arrays, "an array with one value per joint, named like a command", False),
        (beside, "no effort was commanded: the effort that the motors report drives the model", False),
        (measured, "no effort was commanded: a measured one drives the model", False),
    )
    for candidates, reason, sure in ways:
        named = [_driving(s, motors, urdf_joints, moving, wish) for s in candidates]
        if candidates is arrays:
            named = [n for n in named if not are_goals(n, motors, moving)]
        counts = [sum(n.varies(joint) for joint in moving) for n in named]
        if not any(counts):
            continue
        found = named[int(np.argmax(counts))]
        if found.unclear:
            raise RecordingError(found.unclear)
        if found.signal.joints:
            reason = "one topic for each joint, put together; their names tell whose they are"
        elif not found.signal.names:
            reason, sure = f"{reason}; it names no joints, its columns are taken in the order of the URDF", False
        return found, reason, sure and sum(count == max(counts) for count in counts) == 1
    single = [s.topic for s in arrays if s.values.shape[1] == 1]
    if len(single) > 1:
        raise RecordingError(
            f"nothing in the bag drives the motors on one topic: commands come joint by joint, on {', '.join(single)}; "
            "put them together into one sensor_msgs/msg/JointState with names and effort, and record that"
        )
    complain_of_lengths(signals, ("effort", "torque", "current"))
    raise RecordingError(
        "nothing in the bag drives the motors: no effort on a command topic nor with the joint positions that varies "
        f"for {', '.join(moving)}; record the duty cycle, voltage or torque (JointState.effort) beside the positions"
    )


def _driving(
    signal: Signal, motors: NamedSignal, urdf_joints: tuple[str, ...], moving: tuple[str, ...], wish: Wish
) -> NamedSignal:
    """What a command calls the joints; one without names has as many columns as the encoder, or as joints move."""
    if signal.names:
        named = named_signal(signal, urdf_joints, wish)
        if named.by_order and motors.by_order and {*named.names.values()} == {*motors.names.values()}:
            return replace(named, names=motors.names)  # strange names, but the encoders have the same ones
        return named
    if signal.joints:
        return NamedSignal(signal, {joint: str(place) for place, joint in enumerate(signal.joints)})
    shown = tuple(joint for joint in urdf_joints if joint in motors.names)
    chosen = tuple(joint for joint in urdf_joints if joint in wish.joints)
    fits = next((c for c in (chosen, shown, moving, urdf_joints) if len(c) == signal.values.shape[1]), ())
    if signal.topic == motors.signal.topic and not motors.signal.names:
        return NamedSignal(signal, motors.names)  # of the same message, in the same order
    return by_place(signal, fits, moving)
