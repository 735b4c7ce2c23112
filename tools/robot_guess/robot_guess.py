# SPDX-License-Identifier: BSD-3-Clause
"""All guesses about one robot, each with its reason."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.joint_motion import joint_motion
from jointscope.robots.recording import Stream
from jointscope.robots.rigid_tree import RigidTree, moving_joints
from jointscope.robots.units import si_factor
from jointscope.robots.urdf_bodies import UrdfBodies
from jointscope.tools.bags.open_bag import Progress
from jointscope.tools.robot_guess.command_order import order_by_motion
from jointscope.tools.robot_guess.drive_values import DriveValues, drive_values
from jointscope.tools.robot_guess.encoder_noise import encoder_noise
from jointscope.tools.robot_guess.gyro_mount import Mount, find_mount, seen_rate
from jointscope.tools.robot_guess.joint_signs import SignGuess, encoder_signs
from jointscope.tools.robot_guess.named_signal import Chosen, Wish
from jointscope.tools.robot_guess.other_joints import HeldJoint, Typed, held_joints
from jointscope.tools.robot_guess.position_units import UnitGuess, position_units, seen_rates
from jointscope.tools.robot_guess.roles import Roles, assign_roles, command_unit
from jointscope.tools.robot_guess.sample_times import guess_sample_times
from jointscope.tools.robot_guess.sensor_noise import NoiseGuess, guess_noise
from jointscope.tools.robot_guess.signals import Signal, read_signals

Array = NDArray[np.float64]

GRAVITY = (0.0, 0.0, -9.81)  # [m/s^2] ROS: z of the base points up
SUPPLY = 24.0  # [V]
ENOUGH = 3000  # instants for the mounting of a gyroscope


@dataclass(frozen=True)
class GuessedGyro:
    """A gyroscope, where it seems to sit, and its noise."""

    name: str
    signal: Signal
    mount: Mount
    noise: NoiseGuess


@dataclass(frozen=True)
class RobotGuess:
    """What a URDF and a bag say about a robot.

    Attributes:
        name: of the robot.
        urdf: its file.
        bag: path of the bag.
        roles: which signal is what.
        masses: whether the URDF has inertias for all moving bodies.
        position_units: of the encoders in the bag.
        encoder_signs: which way the joints' encoders count.
        command_unit: unit of the drive and why.
        drives: start values by joint.
        encoder_noise, link_noise, torque_noise: of the sensors.
        gyros: those that sit on a moving link.
        left_out: what the bag also holds and why it is not used.
        stamped_by: gyroscope with the stamps of each joint's samples, or BY_MESSAGE; empty if that holds for all.
        held: other joints that matter, and where they stand [rad or m].
        following: sentences about mimic joints of the URDF.
        elastic: joints that get a spring at once, as a gyroscope behind them sees what their motors do not.
    """

    name: str
    urdf: Path
    bag: str
    roles: Roles
    masses: bool
    position_units: UnitGuess
    encoder_signs: SignGuess
    command_unit: tuple[str, str]
    drives: list[DriveValues]
    encoder_noise: tuple[NoiseGuess, ...]
    link_noise: tuple[NoiseGuess, ...] | None
    torque_noise: NoiseGuess | None
    gyros: list[GuessedGyro]
    left_out: list[str] = field(default_factory=list)
    elastic: tuple[str, ...] = ()
    slides: tuple[str, ...] = ()
    stamped_by: tuple[str, ...] = ()
    held: tuple[HeldJoint, ...] = ()
    following: tuple[str, ...] = ()

    @property
    def free_links(self) -> bool:
        """Whether only transmissions can be modelled: no masses, but encoders on both sides."""
        return not self.masses and self.roles.link_encoder is not None


def guess_robot(typed: Typed, progress: Progress | None = None) -> RobotGuess:
    """Guesses a robot.

    Args:
        typed: URDF, bag and what the user said about them.
        progress: called with the number of messages read and expected.

    Raises:
        RobotError: the URDF cannot be read, or has neither masses nor are there encoders on the links.
        RecordingError: the bag cannot be read, lacks positions or what drives the motors, or a joint moves that must
            not be left out.
    """
    urdf, known = typed.urdf, moving_joints(typed.urdf)
    bodies = UrdfBodies.read(urdf)
    _no_followers(bodies, typed.wish)
    signals = read_signals(typed.bag, progress)
    roles = assign_roles(signals, known, _slides(bodies), typed.wish)
    masses, trouble = _masses(urdf, roles.joints)
    if not masses:
        roles = assign_roles(signals, known, _slides(bodies), typed.wish, linked=True)
        if roles.link_encoder is None:
            raise RobotError(
                f"{urdf.name} has no inertias for all moving links, and the bag no encoders on the links: expected one "
                f"of them; add <inertial> to the links, or record a topic with the positions of the links ({trouble})"
            )
    held = held_joints(bodies, roles, typed, free_links=not masses)
    tree = RigidTree(urdf, roles.joints, np.array(GRAVITY), inertias=masses)
    raw = _stream(roles.motor_encoder, roles.joints)
    links = None if roles.link_encoder is None else _stream(roles.link_encoder, roles.joints)
    streams = [s.stream(("x", "y", "z")) for s in roles.imus]
    units = position_units(tree, links or raw, streams)
    held = _in_si(held, bodies, tree, units)
    tree = tree.locked_at({h.joint: h.position for h in held})
    # the links turn the gyroscopes, and their encoders know where zero is
    encoder, seen = (replace(stream, values=stream.values * units.factor) for stream in (raw, links or raw))
    drive = command_unit(roles.command)
    roles = replace(roles, command=_ordered(roles, tree, encoder, masses))
    command = _stream(roles.command, roles.joints)
    torque = None if roles.joint_torque is None else _stream(roles.joint_torque, roles.joints)
    per_unit = SUPPLY if drive[0] == "duty" else 1.0

    def noise(positions: Stream) -> tuple[NoiseGuess, ...]:
        scaled = replace(positions, values=positions.values * np.array(units.scales or 1.0))
        return encoder_noise(scaled, units.units, tree.slides, {} if units.scales else roles.stances)

    def drives(positions: Stream) -> list[DriveValues]:
        return drive_values(tree, positions, command, per_unit, torque, masses)

    signs = encoder_signs(tree, seen_rates(seen, streams), lambda: [drive.sign for drive in drives(encoder)])
    turned, seen = (replace(stream, values=stream.values * np.array(signs.signs)) for stream in (encoder, seen))
    gyros, left_out = _gyros(tree, seen, roles.imus, streams, signs)
    left_out += _unused(signals, roles, masses)
    return RobotGuess(
        name=typed.name or urdf.stem,
        urdf=urdf,
        bag=str(typed.bag),
        roles=roles,
        masses=masses,
        position_units=units,
        encoder_signs=signs,
        command_unit=drive,
        drives=drives(turned),
        encoder_noise=noise(raw),
        link_noise=None if links is None else noise(links),
        torque_noise=None if torque is None else guess_noise(torque.times, torque.values, "N m"),
        gyros=gyros,
        left_out=left_out,
        slides=tree.slides,
        stamped_by=_sample_times(roles, gyros),
        elastic=_seen(tree, gyros) if masses else (),
        held=held,
        following=_following(bodies, roles.joints),
    )


def _no_followers(bodies: UrdfBodies, wish: Wish) -> None:
    """Complains about mimic joints among those that the user named.

    Raises:
        RobotError: there is one.
    """
    for joint in (*wish.joints, *wish.locked):
        if joint in bodies.followers:
            raise RobotError(
                f"{joint} is a mimic joint of {bodies.path.name}: {joint} follows {bodies.followers[joint].leader} and "
                f"is modelled with it; leave it out of --joints and --lock"
            )


def _slides(bodies: UrdfBodies) -> tuple[str, ...]:
    """Prismatic joints of a URDF."""
    kinds = {name: joint.shortname() for name, joint in zip(bodies.model.names, bodies.model.joints, strict=True)}
    return tuple(joint for joint in bodies.free if kinds[joint].startswith("JointModelP"))


def _ordered(roles: Roles, tree: RigidTree, encoder: Stream, masses: bool) -> Chosen:
    """The command; where it names no joints, with its columns in the order that the motion asks for."""
    command, signal = roles.command, roles.command.signal
    if signal.names or signal.topic == roles.motor_encoder.signal.topic:
        return command
    places = tuple(int(name) for name in command.names) or tuple(range(tree.n))
    found = order_by_motion(tree, masses, encoder, signal.times, signal.values, places)
    if found == places:
        return command
    reason = "its messages name no joints; the motion asks for this order of their columns"
    return replace(command, names=tuple(map(str, found)), reason=reason, sure=False)


def _in_si(held: Sequence[HeldJoint], bodies: UrdfBodies, tree: RigidTree, found: UnitGuess) -> tuple[HeldJoint, ...]:
    """Joints that are held, their positions in rad and m: they are measured in the unit of others of their kind."""
    of_kind = {joint in tree.slides: unit for joint, unit in zip(tree.joints, found.units, strict=True)}
    slides = _slides(bodies)
    unit = {h.joint: of_kind.get(h.joint in slides, "m" if h.joint in slides else "rad") for h in held}
    before = "; measured before a gear whose ratio nothing tells: divide by it" if found.scales else ""
    return tuple(
        replace(h, position=h.position * si_factor(unit[h.joint]), reason=h.reason + (before if h.seen else ""))
        for h in held
    )


def _following(bodies: UrdfBodies, joints: tuple[str, ...]) -> tuple[str, ...]:
    """Sentences about mimic joints that move with the robot's."""
    return tuple(f"{name} follows {f.leader}" for name, f in bodies.followers.items() if f.leader in joints)


def _sample_times(roles: Roles, gyros: Sequence[GuessedGyro]) -> tuple[str, ...]:
    """Whose stamps the joints' samples have; the finer encoders tell."""
    chosen = roles.link_encoder or roles.motor_encoder
    return guess_sample_times(chosen.signal, chosen.names or roles.joints, {g.name: g.signal for g in gyros})


def _seen(tree: RigidTree, gyros: Sequence[GuessedGyro]) -> tuple[str, ...]:
    """Joints that turn with a gyroscope behind them."""
    seen = {joint for gyro in gyros for joint in tree.joints_below(gyro.mount.body)}
    return tuple(name for j, name in enumerate(tree.joints) if j in seen and name not in tree.slides)


def _masses(urdf: Path, joints: tuple[str, ...]) -> tuple[bool, str]:
    """Whether the bodies have masses, and what is wrong if not."""
    try:
        RigidTree(urdf, joints, np.array(GRAVITY))
    except RobotError as err:
        return False, str(err)
    return True, ""


def _stream(chosen: Chosen, joints: tuple[str, ...], factor: float | Array = 1.0) -> Stream:
    return chosen.signal.stream(chosen.names or joints, factor)


def _gyros(
    tree: RigidTree, encoder: Stream, imus: Sequence[Signal], streams: Sequence[Stream], signs: SignGuess
) -> tuple[list[GuessedGyro], list[str]]:
    """Gyroscopes with their links, and a sentence for each one that is on none."""
    motion = joint_motion(encoder, np.zeros(encoder.values.shape[1]))
    found: list[GuessedGyro] = []
    left_out = []
    for signal, stream in zip(imus, streams, strict=True):
        seen = seen_rate(motion, stream, ENOUGH)
        mount = None if seen is None else find_mount(tree, seen, mirrored=signs.mirrored)
        if mount is None:
            left_out.append(f"{signal.topic}: stands still, or no link turns like it")
            continue
        name = _sensor_name(signal.topic, [gyro.name for gyro in found])
        found.append(GuessedGyro(name, signal, mount, guess_noise(stream.times, stream.values, mount.unit)))
    return found, left_out


def _sensor_name(topic: str, taken: Sequence[str]) -> str:
    """The first part of a topic, as "imu1" of "/imu1/data_raw"; numbered where that is taken."""
    name = next((part for part in topic.split("/") if part), "imu").replace("-", "_")
    number = 2
    while name in taken:
        name, number = f"{name.rstrip('0123456789')}{number}", number + 1
    return name


def _unused(signals: Sequence[Signal], roles: Roles, masses: bool) -> list[str]:
    used = {roles.motor_encoder.signal.topic, roles.command.signal.topic, *(s.topic for s in roles.imus)}
    if roles.link_encoder is not None:
        used.add(roles.link_encoder.signal.topic)
    said = [f"{topic}: no role found for it" for topic in dict.fromkeys(s.topic for s in signals) if topic not in used]
    if roles.joint_torque is not None and masses:
        said.append(f"{roles.joint_torque.signal.topic}, effort: measured joint torques need link_dynamics: free")
    return said
