# SPDX-License-Identifier: BSD-3-Clause
"""All guesses about one robot, each with its reason."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.screening.exchanged_joints import Exchange, Wiring
from jointscope.graphs.starts.command_limits import limited
from jointscope.graphs.starts.drive_regression import Driven, Links
from jointscope.graphs.starts.drive_signal import acts_until_the_next
from jointscope.graphs.starts.uneven_limits import even_limits
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.joint_motion import joint_motion
from jointscope.robots.recordings.recording import Stream
from jointscope.robots.units import si_factor
from jointscope.robots.urdf.urdf_bodies import UrdfBodies
from jointscope.robots.urdf.usable_joints import moving_joints
from jointscope.tools.bags.messages.open_bag import Progress
from jointscope.tools.init.estimates.drive_values import EXPLAINED, TYPED, Drives, DriveValues, find_drives, find_signs
from jointscope.tools.init.estimates.gyro_mount import Mount, find_mount, seen_rate
from jointscope.tools.init.estimates.joint_signs import SignGuess, encoder_signs
from jointscope.tools.init.estimates.measured_currents import GuessedCurrents, guess_currents
from jointscope.tools.init.estimates.measured_robot import GRAVITY, MeasuredRobot, measured_robot, role_stream
from jointscope.tools.init.estimates.motor_zero import motor_zero
from jointscope.tools.init.estimates.position_units import UnitGuess, seen_rates
from jointscope.tools.init.estimates.soft_joints import giving_joints
from jointscope.tools.init.estimates.wiring_by_torques import wiring_by_torques
from jointscope.tools.init.streams.other_joints import HeldJoint, Typed
from jointscope.tools.init.streams.roles import Roles
from jointscope.tools.init.streams.sample_times import guess_sample_times
from jointscope.tools.init.streams.sensor_noise import NoiseGuess, guess_noise
from jointscope.tools.init.streams.signals import Signal, read_signals
from jointscope.tools.init.unused import unused

Array = NDArray[np.float64]

SUPPLY = 24.0  # [V]
ENOUGH = 3000  # instants for the mounting of a gyroscope


@dataclass(frozen=True)
class GuessedGyro:
    """A gyroscope, where it seems to sit, its noise, and what the same messages say about accelerations."""

    name: str
    signal: Signal
    mount: Mount
    noise: NoiseGuess
    acceleration: Signal | None = None


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
        motor_zero: reading of each motor's encoder at zero, where encoders on the links tell it [rad or m].
        following: sentences about mimic joints of the URDF.
        elastic: joints that get a spring at once: a gyroscope or an encoder behind them sees what their motors do not.
        gravity: in the base frame [m/s^2].
        gravity_reason: why it does not point along -z; empty if it does.
        held_command: whether each value of the command acts until the next one; else it was measured.
        currents: of the motors, where efforts beside their positions seem to be that.
        exchanged: two joints that seem to have each other's columns.
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
    motor_zero: tuple[float, ...] = ()
    gravity: tuple[float, ...] = GRAVITY
    gravity_reason: str = ""
    held_command: bool = True
    currents: GuessedCurrents | None = None
    exchanged: Exchange | None = None

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
    signals = read_signals(typed.bag, progress, moving_joints(typed.urdf))
    robot = measured_robot(typed, signals)
    roles, tree, masses = robot.roles, robot.tree, robot.masses
    torque = None if roles.joint_torque is None else role_stream(roles.joint_torque, roles.joints)
    noises = robot.noise(roles.motor_encoder)
    of_links = None if roles.link_encoder is None else robot.noise(roles.link_encoder)

    def drives(positions: Stream, elastic: tuple[str, ...] = (), links: Links | None = None) -> Drives:
        return _drives(robot, positions, links, noises, torque, elastic, typed.unit)

    # the links turn the gyroscopes, and their encoders know where zero is
    encoder, seen = robot.encoder, robot.links or robot.encoder

    def motors(signs: tuple[float, ...]) -> list[float]:
        turned = replace(encoder, values=encoder.values * np.array(signs))
        return [drive.sign for drive in drives(turned, roles.joints).joints]

    signs = encoder_signs(tree, seen_rates(seen, robot.gyros), motors)
    turned, seen = (replace(stream, values=stream.values * np.array(signs.signs)) for stream in (encoder, seen))
    zero = np.zeros(len(roles.joints))
    if masses and robot.links is not None:
        zero = motor_zero(turned, seen, _in_si(robot, noises))
        turned = replace(turned, values=turned.values - zero)
    gyros, left_out = _gyros(tree, seen, zip(roles.imus, robot.gyros, strict=True), signals, signs)
    giving, behind = _giving(robot, turned, seen, noises, of_links)
    elastic = (*_seen(tree, gyros), *giving) if masses else ()
    drive, exchanged = drives(turned, elastic, behind), None
    if masses and not robot.gyros and robot.links is None:
        others, exchanged = _by_torques(robot, turned, drive)
        if others is not None:
            signs = others
            drive = drives(replace(encoder, values=encoder.values * np.array(signs.signs)))
    currents = guess_currents(roles, turned, drive)
    return RobotGuess(
        name=typed.name or typed.urdf.stem,
        urdf=typed.urdf,
        bag=str(typed.bag),
        roles=roles,
        masses=masses,
        position_units=robot.units,
        encoder_signs=signs,
        command_unit=drive.unit,
        drives=drive.joints,
        gravity=tuple(drive.gravity.tolist()),
        gravity_reason=drive.gravity_reason,
        held_command=drive.held,
        exchanged=exchanged,
        currents=currents,
        encoder_noise=noises,
        link_noise=of_links,
        torque_noise=None if torque is None else guess_noise(torque.times, torque.values, "N m"),
        gyros=gyros,
        left_out=left_out + unused(signals, roles, masses, currents, drive.unit[0]),
        slides=tree.slides,
        stamped_by=_sample_times(roles, gyros),
        elastic=elastic,
        held=robot.held,
        motor_zero=tuple(zero.tolist()),
        following=_following(robot.bodies, roles.joints),
    )


def _drives(
    robot: MeasuredRobot,
    encoder: Stream,
    links: Links | None,
    noises: Sequence[NoiseGuess],
    torque: Stream | None,
    elastic: tuple[str, ...],
    unit: str,
) -> Drives:
    """Unit of the command, and the drive of each joint."""
    roles, tree = robot.roles, robot.tree
    sigmas = _in_si(robot, noises)
    command = role_stream(roles.command, roles.joints)
    if not robot.masses:
        found = find_signs(encoder, command, sigmas, torque, tree.gravity)
        return replace(found, unit=(unit, TYPED)) if unit else found
    measured = roles.command.signal.topic == roles.motor_encoder.signal.topic
    # what motors report beside their positions is what they gave
    limits = [None] * tree.n if measured else even_limits(tree, [Driven(encoder, command, links=links)], sigmas)
    hidden = elastic if links is None else ()  # of these the motion of the motors does not tell the load
    limits = [None if joint in hidden else limit for joint, limit in zip(tree.joints, limits, strict=True)]
    command = limited(command, limits)
    told = None if hidden else acts_until_the_next(tree, [Driven(encoder, command, links=links)], sigmas)
    held = not measured if told is None else told
    found = find_drives(tree, encoder, command, sigmas, held=held, elastic=elastic, unit=unit, links=links)
    joints = [replace(drive, limit=limit) for drive, limit in zip(found.joints, limits, strict=True)]
    return replace(found, joints=joints)


def _by_torques(robot: MeasuredRobot, encoder: Stream, drive: Drives) -> tuple[SignGuess | None, Exchange | None]:
    """What the torques say of the joints' wiring, where they say otherwise than URDF and names."""
    if drive.gravity_reason and min(joint.explained for joint in drive.joints) > EXPLAINED:
        return None, None  # a base that hangs or stands otherwise explains it
    command = limited(role_stream(robot.roles.command, robot.roles.joints), [joint.limit for joint in drive.joints])
    return wiring_by_torques(Wiring(robot.tree, encoder, command, drive.held))


def _in_si(robot: MeasuredRobot, noises: Sequence[NoiseGuess]) -> Array:
    """Noise of positions behind gears, which is in the unit of the bag, shape (n,) [rad or m]."""
    return np.array([si_factor(unit) * noise.sigma for unit, noise in zip(robot.units.units, noises, strict=True)])


def _following(bodies: UrdfBodies, joints: tuple[str, ...]) -> tuple[str, ...]:
    """Sentences about mimic joints that move with the robot's."""
    return tuple(f"{name} follows {f.leader}" for name, f in bodies.followers.items() if f.leader in joints)


def _sample_times(roles: Roles, gyros: Sequence[GuessedGyro]) -> tuple[str, ...]:
    """Whose stamps the joints' samples have; the finer encoders tell."""
    chosen = roles.link_encoder or roles.motor_encoder
    return guess_sample_times(chosen.signal, chosen.names or roles.joints, {g.name: g.signal for g in gyros})


def _seen(tree: RigidTree, gyros: Sequence[GuessedGyro]) -> tuple[str, ...]:
    """Joints that turn an inertia with a gyroscope behind them."""
    seen = {joint for gyro in gyros for joint in tree.joints_below(gyro.mount.body)}
    no_spring = {*tree.slides, *tree.massless}
    return tuple(name for j, name in enumerate(tree.joints) if j in seen and name not in no_spring)


def _giving(
    robot: MeasuredRobot,
    motor: Stream,
    links: Stream,
    of_motors: Sequence[NoiseGuess],
    of_links: Sequence[NoiseGuess] | None,
) -> tuple[tuple[str, ...], Links | None]:
    """Joints whose two encoders tell that they give way, and what the links do; nothing and None where all is rigid."""
    if of_links is None or not robot.masses:
        return (), None
    behind = Links(links, _in_si(robot, of_links))
    giving = giving_joints(robot.tree, motor, behind, _in_si(robot, of_motors))
    return giving, behind if giving else None


def _gyros(
    tree: RigidTree,
    encoder: Stream,
    imus: Iterable[tuple[Signal, Stream]],
    signals: Sequence[Signal],
    signs: SignGuess,
) -> tuple[list[GuessedGyro], list[str]]:
    """Gyroscopes with their links and what their messages say of accelerations; a sentence for each that is on none."""
    felt = {signal.topic: signal for signal in signals if signal.quantity == "acceleration"}
    motion = joint_motion(encoder, np.zeros(encoder.values.shape[1]))
    found: list[GuessedGyro] = []
    left_out = []
    for signal, stream in imus:
        seen = seen_rate(motion, stream, ENOUGH)
        mount = None if seen is None else find_mount(tree, seen, mirrored=signs.mirrored)
        if mount is None:
            left_out.append(f"{signal.topic}: stands still, or no link turns like it")
            continue
        name = _sensor_name(signal.topic, [gyro.name for gyro in found])
        noise = guess_noise(stream.whole.times, stream.whole.values, mount.unit)
        found.append(GuessedGyro(name, signal, mount, noise, felt.get(signal.topic)))
    return found, left_out


def _sensor_name(topic: str, taken: Sequence[str]) -> str:
    """The first part of a topic, as "imu1" of "/imu1/data_raw"; numbered where that is taken."""
    name = next((part for part in topic.split("/") if part), "imu").replace("-", "_")
    number = 2
    while name in taken:
        name, number = f"{name.rstrip('0123456789')}{number}", number + 1
    return name
