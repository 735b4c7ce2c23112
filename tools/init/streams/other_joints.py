# SPDX-License-Identifier: BSD-3-Clause
"""Joints of the URDF that are not the robot's: where they are held, and which of them must not be left out.

Only joints before or behind those of the robot matter. They are locked where the bag has them; one that moves all the
same is held at its mean only if the user says so.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from jointscope.robots.errors import RecordingError
from jointscope.robots.urdf.urdf_bodies import UrdfBodies
from jointscope.tools.init.streams.named_signal import Wish
from jointscope.tools.init.streams.roles import Roles

NOT_THERE = "assumed at 0: not in the bag"
NO_NUMBER = "assumed at 0: no number in the bag"


@dataclass(frozen=True)
class Typed:
    """The command line of `jointscope init`, to say what to type next.

    Attributes:
        urdf, bag, output: paths.
        wish: joints, names and locks.
        name: of the robot; empty for that of the URDF.
        unit: of the command; empty where the recording shall tell.
        targets: texts TOPIC=LINK of what a tracker measures.
    """

    urdf: Path
    bag: Path
    output: Path | None = None
    wish: Wish = field(default_factory=Wish)
    name: str = ""
    unit: str = ""
    targets: tuple[str, ...] = ()

    def command(self) -> str:
        """As it is typed."""
        wish = self.wish
        words = ["jointscope", "init", str(self.urdf), str(self.bag)]
        if wish.joints:
            words += ["--joints", ",".join(f"{j}={wish.names[j]}" if j in wish.names else j for j in wish.joints)]
        if wish.locked:
            words += ["--lock", ",".join(wish.locked)]
        if self.name:
            words += ["--name", self.name]
        if self.unit:
            words += ["--unit", self.unit.replace(" ", "")]
        words += [word for target in self.targets for word in ("--target", target)]
        words += ["-o", str(self.output or f"{self.urdf.stem}.yaml")]
        return shlex.join(words)

    def using(self, joints: Sequence[str]) -> Typed:
        """With these joints."""
        return replace(self, wish=replace(self.wish, joints=tuple(joints)))

    def locking(self, joints: Sequence[str]) -> Typed:
        """With these joints held, too."""
        return replace(self, wish=replace(self.wish, locked=(*self.wish.locked, *joints)))


@dataclass(frozen=True)
class HeldJoint:
    """A joint that stands where it is.

    Attributes:
        joint: its name.
        position: in the unit of the bag.
        reason: why there.
        seen: whether the bag has it.
        on_word: whether it moves, and is held because the user says so.
    """

    joint: str
    position: float
    reason: str
    seen: bool
    on_word: bool = False


def held_joints(bodies: UrdfBodies, roles: Roles, typed: Typed, free_links: bool = False) -> tuple[HeldJoint, ...]:
    """The joints that matter beside those of the robot, each where it is held.

    Args:
        bodies: of the URDF.
        roles: who is who in the bag.
        typed: what the user typed.
        free_links: no equations of motion: other joints that move spoil nothing but the gyroscopes behind them.

    Raises:
        RecordingError: one of them moves, with the command that holds it or uses it.
    """
    others = bodies.that_matter(roles.joints)
    blind = [j for j in others if j in roles.no_number and j in roles.driven and j not in typed.wish.locked]
    if blind:
        raise RecordingError(_blind(blind, roles, typed))
    moving = [j for j in others if j in roles.stances and roles.stances[j].moves and j not in typed.wish.locked]
    if moving and not free_links:
        raise RecordingError(_left_out(moving, bodies, roles, typed))
    return tuple(_held(joint, roles, typed.wish) for joint in others)


def _held(joint: str, roles: Roles, wish: Wish) -> HeldJoint:
    stance = roles.stances.get(joint)
    if stance is None:
        return HeldJoint(joint, 0.0, NO_NUMBER if joint in roles.no_number else NOT_THERE, seen=False)
    moved = f"{stance.span:.2g}"
    if stance.moves or joint in wish.locked:
        said = "--lock says so" if joint in wish.locked else "not among the joints"
        return HeldJoint(joint, stance.mean, f"{said}; it moves by {moved}, this is its mean", True, on_word=True)
    return HeldJoint(joint, stance.mean, f"stands still there, moves by {moved}", seen=True)


def _blind(joints: Sequence[str], roles: Roles, typed: Typed) -> str:
    """Why joints that are driven, and whose positions are no numbers, cannot be left out."""
    who = ", ".join(joints)
    return (
        f"{who}: driven in {typed.bag}, but its position is no number (NaN) in most messages of "
        f"{roles.motor_encoder.signal.topic}, so nothing tells how it moved, and {', '.join(roles.joints)} feel it; "
        f"expected an encoder that works. If it stood at zero, type: {typed.locking(joints).command()}"
    )


def _left_out(moving: Sequence[str], bodies: UrdfBodies, roles: Roles, typed: Typed) -> str:
    """Why moving joints cannot be left out, and what to type instead."""
    them = "it" if len(moving) == 1 else "them"
    who = ", ".join(f"{joint} (by {roles.stances[joint].span:.2g})" for joint in moving)
    driven = [joint for joint in moving if joint in roles.driven]
    why = "--joints leaves it out" if typed.wish.joints else "nothing in the bag drives it"
    hold = f"to hold {them} at the mean, type: {typed.locking(moving).command()}"
    text = f"{who} moves in {typed.bag} and acts on {', '.join(roles.joints)}, but {why}"
    if len(moving) > 1:
        text = text.replace(" moves in ", " move in ").replace("acts on", "act on").replace("s it", "s them")
    if not typed.wish.joints or not driven:
        return f"{text}; {hold}"
    order = [joint for joint in bodies.free if joint in (*roles.joints, *driven)]
    using = typed.using(order)
    rest = [joint for joint in moving if joint not in driven]
    return f"{text}; to use {', '.join(driven)}, type: {(using.locking(rest) if rest else using).command()}; {hold}"
