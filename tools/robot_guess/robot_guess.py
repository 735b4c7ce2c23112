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
from jointscope.tools.bags.open_bag import Progress
from jointscope.tools.robot_guess.drive_values import Drives, DriveValues, find_drives, find_signs
from jointscope.tools.robot_guess.gyro_mount import Mount, SignGuess, find_mount, joint_signs
from jointscope.tools.robot_guess.roles import Chosen, Roles, assign_roles
from jointscope.tools.robot_guess.sample_times import guess_sample_times
from jointscope.tools.robot_guess.sensor_noise import NoiseGuess, guess_noise
from jointscope.tools.robot_guess.signals import Signal, read_signals

Array = NDArray[np.float64]

GRAVITY = (0.0, 0.0, -9.81)  # [m/s^2] ROS: z of the base points up
SUPPLY = 24.0  # [V]


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
        position_units: of the encoders in the bag, by joint: "rad" or "deg", of a prismatic joint "m" or "mm".
        encoder_signs: which way the joints' encoders count.
        command_unit: unit of the drive and why.
        drives: start values by joint.
        encoder_noise, link_noise, torque_noise: of the sensors.
        gyros: those that sit on a moving link.
        left_out: what the bag also holds and why it is not used.
        stamped_by: gyroscope with the stamps of each joint's samples, or BY_MESSAGE; empty if that holds for all.
        elastic: joints that get a spring at once, as a gyroscope behind them sees what their motors do not.
        gravity: in the base frame [m/s^2].
        gravity_reason: why it does not point along -z; empty if it does.
    """

    name: str
    urdf: Path
    bag: str
    roles: Roles
    masses: bool
    position_units: tuple[str, ...]
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
    gravity: tuple[float, ...] = GRAVITY
    gravity_reason: str = ""

    @property
    def free_links(self) -> bool:
        """Whether only transmissions can be modelled: no masses, but encoders on both sides."""
        return not self.masses and self.roles.link_encoder is not None


def guess_robot(
    urdf: Path, bag: Path, joints: Sequence[str] = (), name: str = "", progress: Progress | None = None
) -> RobotGuess:
    """Guesses a robot.

    Args:
        urdf: its bodies and joints.
        bag: a recording in which all joints move.
        joints: those to use; all that the bag shows if empty.
        name: of the robot; that of the URDF's file if empty.
        progress: called with the number of messages read and expected.

    Raises:
        RobotError: the URDF cannot be read, or has neither masses nor are there encoders on the links.
        RecordingError: the bag cannot be read, or lacks positions or what drives the motors.
    """
    known = moving_joints(urdf)
    signals = read_signals(bag, progress)
    roles = assign_roles(signals, known, tuple(joints))
    tree, masses = _tree(urdf, roles.joints)
    if not masses and roles.link_encoder is None:
        raise RobotError(
            f"{urdf.name} has no inertias for all moving links, and the bag no encoders on the links: expected one of "
            "them; add <inertial> to the links, or record a topic with the positions of the links"
        )
    units = _position_units(tree, roles)
    factor = np.array([si_factor(unit) for unit in units])
    encoder = _stream(roles.motor_encoder, roles.joints, factor)
    streams = [s.stream(("x", "y", "z")) for s in roles.imus]
    # the links turn the gyroscopes, and their encoders know where zero is
    seen = encoder if roles.link_encoder is None else _stream(roles.link_encoder, roles.joints, factor)
    signs = joint_signs(tree, joint_motion(seen, np.zeros(len(roles.joints))), streams)
    turned, seen = (replace(stream, values=stream.values * np.array(signs.signs)) for stream in (encoder, seen))
    gyros, left_out = _gyros(tree, seen, roles.imus, streams)
    elastic = _seen(tree, gyros) if masses else ()
    noises = _noises(roles.motor_encoder, roles, units)
    torque = None if roles.joint_torque is None else _stream(roles.joint_torque, roles.joints)
    drives = _drives(tree, turned, roles, factor * [noise.sigma for noise in noises], torque, elastic, masses)
    left_out += _unused(signals, roles, masses)
    return RobotGuess(
        name=name or urdf.stem,
        urdf=urdf,
        bag=str(bag),
        roles=roles,
        masses=masses,
        position_units=units,
        encoder_signs=signs,
        command_unit=drives.unit,
        drives=drives.joints,
        gravity=tuple(drives.gravity.tolist()),
        gravity_reason=drives.gravity_reason,
        encoder_noise=noises,
        link_noise=None if roles.link_encoder is None else _noises(roles.link_encoder, roles, units),
        torque_noise=None if torque is None else guess_noise(torque.times, torque.values, "N m"),
        gyros=gyros,
        left_out=left_out,
        slides=tree.slides,
        stamped_by=_sample_times(roles, gyros),
        elastic=elastic,
    )


def _drives(
    tree: RigidTree,
    encoder: Stream,
    roles: Roles,
    sigmas: Array,
    torque: Stream | None,
    elastic: tuple[str, ...],
    masses: bool,
) -> Drives:
    """Unit of the command, and the drive of each joint."""
    command = _stream(roles.command, roles.joints)
    if not masses:
        return find_signs(encoder, command, sigmas, torque, tree.gravity)
    measured = roles.command.signal.topic == roles.motor_encoder.signal.topic
    return find_drives(tree, encoder, command, sigmas, held=not measured, elastic=elastic)


def _sample_times(roles: Roles, gyros: Sequence[GuessedGyro]) -> tuple[str, ...]:
    """Whose stamps the joints' samples have; the finer encoders tell."""
    chosen = roles.link_encoder or roles.motor_encoder
    return guess_sample_times(chosen.signal, chosen.names or roles.joints, {g.name: g.signal for g in gyros})


def _seen(tree: RigidTree, gyros: Sequence[GuessedGyro]) -> tuple[str, ...]:
    """Joints that turn with a gyroscope behind them."""
    seen = {joint for gyro in gyros for joint in tree.joints_below(gyro.mount.body)}
    return tuple(name for j, name in enumerate(tree.joints) if j in seen and name not in tree.slides)


def _tree(urdf: Path, joints: tuple[str, ...]) -> tuple[RigidTree, bool]:
    """The bodies, and whether they have masses."""
    gravity = np.array(GRAVITY)
    try:
        return RigidTree(urdf, joints, gravity), True
    except RobotError:
        return RigidTree(urdf, joints, gravity, inertias=False), False


def _position_units(tree: RigidTree, roles: Roles) -> tuple[str, ...]:
    """Degrees, or millimetres, where joints that turn, or slide, go far beyond the limits of the URDF."""
    names = roles.motor_encoder.names or roles.joints
    span = np.ptp(roles.motor_encoder.signal.stream(names).values, axis=0)
    beyond = span > 5.0 * (tree.limits[:, 1] - tree.limits[:, 0])
    slides = np.isin(tree.joints, tree.slides)
    turning, sliding = "deg" if np.any(beyond & ~slides) else "rad", "mm" if np.any(beyond & slides) else "m"
    return tuple(sliding if slide else turning for slide in slides)


def _noises(chosen: Chosen, roles: Roles, units: tuple[str, ...]) -> tuple[NoiseGuess, ...]:
    """Noise of each joint's encoder; those that measure in the same unit have the same."""
    stream = _stream(chosen, roles.joints)
    by_unit = {
        unit: guess_noise(stream.times, stream.values[:, [j for j, u in enumerate(units) if u == unit]], unit)
        for unit in dict.fromkeys(units)
    }
    return tuple(by_unit[unit] for unit in units)


def _stream(chosen: Chosen, joints: tuple[str, ...], factor: float | Array = 1.0) -> Stream:
    return chosen.signal.stream(chosen.names or joints, factor)


def _gyros(
    tree: RigidTree, encoder: Stream, imus: Sequence[Signal], streams: Sequence[Stream]
) -> tuple[list[GuessedGyro], list[str]]:
    """Gyroscopes with their links, and a sentence for each one that is on none."""
    motion = joint_motion(encoder, np.zeros(encoder.values.shape[1]))
    found: list[GuessedGyro] = []
    left_out = []
    for signal, stream in zip(imus, streams, strict=True):
        mount = find_mount(tree, motion, stream)
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
