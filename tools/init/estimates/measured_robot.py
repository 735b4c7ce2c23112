# SPDX-License-Identifier: BSD-3-Clause
"""What a bag shows of a robot before signs, mountings and drives are asked for: joints, postures, units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RobotError
from jointscope.robots.recordings.recording import Stream
from jointscope.robots.units import si_factor
from jointscope.robots.urdf.urdf_bodies import UrdfBodies
from jointscope.robots.urdf.usable_joints import moving_joints
from jointscope.tools.init.estimates.position_units import UnitGuess, position_units
from jointscope.tools.init.estimates.units_by_torques import unit_by_torques
from jointscope.tools.init.streams.command_order import order_by_motion
from jointscope.tools.init.streams.encoder_noise import encoder_noise
from jointscope.tools.init.streams.named_signal import Chosen, Wish
from jointscope.tools.init.streams.other_joints import HeldJoint, Typed, held_joints
from jointscope.tools.init.streams.roles import Roles, assign_roles
from jointscope.tools.init.streams.sensor_noise import NoiseGuess
from jointscope.tools.init.streams.signals import Signal

GRAVITY = (0.0, 0.0, -9.81)  # [m/s^2] ROS: z of the base points up


@dataclass(frozen=True)
class MeasuredRobot:
    """Joints and what was measured of them.

    Attributes:
        bodies: of the URDF.
        roles: which signal is what.
        masses: whether the URDF has inertias for all moving bodies.
        tree: the robot, other joints locked where they are held.
        held: those joints [rad or m].
        units: of the encoders in the bag.
        encoder, links: positions as their encoders count [rad or m]; None without encoders on the links.
        gyros: rates as they stand in the bag.
    """

    bodies: UrdfBodies
    roles: Roles
    masses: bool
    tree: RigidTree
    held: tuple[HeldJoint, ...]
    units: UnitGuess
    encoder: Stream
    links: Stream | None
    gyros: list[Stream]

    def noise(self, chosen: Chosen) -> tuple[NoiseGuess, ...]:
        """Noise of each joint's encoder, in the unit of the bag behind gears."""
        scales = self.units.scales
        stream = role_stream(chosen, self.roles.joints, np.array(scales or 1.0))
        return encoder_noise(stream, self.units.units, self.tree.slides, {} if scales else self.roles.stances)


def measured_robot(typed: Typed, signals: list[Signal]) -> MeasuredRobot:
    """Joints of a robot, where others are held, and the units of positions.

    Args:
        typed: URDF, bag and what the user said about them.
        signals: of the bag.

    Raises:
        RobotError: the URDF cannot be read, or has neither masses nor are there encoders on the links.
        RecordingError: positions or what drives the motors are not there, or a joint moves that must not be left out.
    """
    known, bodies = moving_joints(typed.urdf), UrdfBodies.read(typed.urdf)
    _no_followers(bodies, typed.wish)
    roles, masses = _roles(typed, signals, known, bodies)
    held = held_joints(bodies, roles, typed, free_links=not masses)
    tree = RigidTree(typed.urdf, roles.joints, np.array(GRAVITY), inertias=masses)
    encoder = role_stream(roles.motor_encoder, roles.joints)
    links = None if roles.link_encoder is None else role_stream(roles.link_encoder, roles.joints)
    gyros = [signal.stream(("x", "y", "z")) for signal in roles.imus]
    units = position_units(tree, links or encoder, gyros)
    if masses and not gyros and (roles.command.signal.names or roles.command.signal.joints):
        held_command = roles.command.signal.topic != roles.motor_encoder.signal.topic
        command = role_stream(roles.command, roles.joints)
        units = unit_by_torques(tree, links or encoder, command, units, held=held_command)
    held = _in_si(held, bodies, tree, units)
    tree = tree.locked_at({h.joint: h.position for h in held})
    encoder = replace(encoder, values=encoder.values * units.factor)
    links = None if links is None else replace(links, values=links.values * units.factor)
    roles = replace(roles, command=_ordered(roles, tree, encoder, masses))
    return MeasuredRobot(bodies, roles, masses, tree, held, units, encoder, links, gyros)


def role_stream(chosen: Chosen, joints: tuple[str, ...], factor: float | np.ndarray = 1.0) -> Stream:
    """A signal in its role as a stream, times a factor."""
    return chosen.signal.stream(chosen.names or joints, factor)


def _roles(typed: Typed, signals: list[Signal], known: tuple[str, ...], bodies: UrdfBodies) -> tuple[Roles, bool]:
    """Who is who, and whether the robot has masses."""
    roles = assign_roles(signals, known, _slides(bodies), typed.wish)
    trouble, massless = _masses(typed.urdf, roles.joints)
    if not (trouble or massless):
        return roles, True
    linked = assign_roles(signals, known, _slides(bodies), typed.wish, linked=True)
    if linked.link_encoder is not None:
        return linked, False
    if trouble:
        RigidTree(
            typed.urdf, roles.joints, np.array(GRAVITY), inertias=False
        )  # axes and the like are no lack of masses
        if any(inertia.mass < 0.0 for inertia in bodies.model.inertias):
            raise RobotError(trouble)
        raise RobotError(
            f"{typed.urdf.name} has no inertias for all moving links, and the bag no encoders on the links: expected "
            f"one of them; add <inertial> to the links, or record a topic with the positions of the links ({trouble})"
        )
    return roles, True


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
    if signal.names or signal.joints or signal.topic == roles.motor_encoder.signal.topic:
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


def _masses(urdf: Path, joints: tuple[str, ...]) -> tuple[str, tuple[str, ...]]:
    """Why there are no equations of motion with the masses of the URDF, and the joints that move none."""
    try:
        return "", RigidTree(urdf, joints, np.array(GRAVITY)).massless
    except RobotError as err:
        return str(err), ()
