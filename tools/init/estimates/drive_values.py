# SPDX-License-Identifier: BSD-3-Clause
"""Start values of the drives, the signs and the unit of their commands, from the regression on the recorded motion.

What the regression cannot tell from zero gets a small start above zero, and is marked as lost: its prior is wide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.command_limits import CommandLimit
from jointscope.graphs.starts.drive_regression import (
    GAIN,
    INERTIA,
    PLACES,
    DriveEquation,
    Driven,
    Links,
    Value,
    best_width,
    equations_by_width,
    is_impossible,
    load_of,
)
from jointscope.graphs.starts.encoder_motion import slope_noise
from jointscope.graphs.starts.motion_cells import motion_cells
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.estimates.drive_unit import SURE, drive_unit
from jointscope.tools.init.estimates.gravity_guess import clearer_gravity
from jointscope.tools.init.estimates.soft_joints import FirstSpring, first_springs
from jointscope.tools.init.estimates.turning_over import turning_over

Array = NDArray[np.float64]

OPPOSITE = 10.0  # [sigma] from which a motor turns against its command
TOLD = 2.0  # [sigma] above zero from which a value is one
SMALLEST = 0.02  # of the rms torque that a start value explains at least: it must be above zero
MATCHED = 0.3  # of the link's inertia that a motor behind a gear has at least where springs hide it, or nothing tells
HEAVY = 0.25  # of the link's inertia; as much below zero the rotor's may be where masses are wrong
TRUSTED = 0.95  # of the driving torque that must be explained before a unit is concluded from its constant
EXPLAINED = 0.9  # of the driving torque that must be explained before anything is concluded from it
SHARPNESS = 1e4  # [s/rad] of the sign of a velocity
TYPED = "as you said"
SOFT = 0.24  # [s] of windows at least, where a spring may be: below its resonance a joint is rigid


@dataclass(frozen=True)
class DriveValues:
    """One joint's drive, on the side of the joint; per unit of the command, which may have been turned round.

    Attributes:
        start: value above zero of "gain" [N m per unit], "viscous" [N m s/rad], "dry" [N m], "inertia" [kg m2].
        found: what the regression says, with sigmas; empty where it cannot tell.
        explained: share of the driving torque's mean square that the equation of motion explains.
        sign: -1 where the command turns the joint backwards.
        confidence: how far the sign is from the other one [sigma].
        link: inertia of everything behind the joint at the first posture [kg m2]; 1 where masses are not known.
        unknown_scale: whether all values are relative to a guessed constant or rotor inertia, as the recording gives
            ratios only.
        sharpness: k in tanh(k v) of dry friction, from which a calibration may look for it [s/rad]; None where the
            encoder does not show how the joint turns over, or the joint is so fast that it does not matter.
        limit: what the drive gives at the most; None where it gives what was commanded.
        spring: behind it, where encoders on both sides tell it.
        own_links: whether the torques of the links come from encoders of their own, so that no spring is in the way.
    """

    start: Mapping[str, float]
    found: Mapping[str, Value] = field(default_factory=dict)
    explained: float = 0.0
    sign: float = 1.0
    confidence: float = 0.0
    link: float = 1.0
    unknown_scale: bool = False
    sharpness: float | None = None
    limit: CommandLimit | None = None
    spring: FirstSpring | None = None
    own_links: bool = False

    @property
    def is_impossible(self) -> bool:
        """Whether the regression says something that is surely below zero, as no inertia and no friction is."""
        return is_impossible(self.found)

    def is_lost(self, name: str) -> bool:
        """Whether the regression cannot tell a value from zero."""
        value = self.found.get(name)
        return value is None or self.unknown_scale or value.value <= TOLD * value.sigma


@dataclass(frozen=True)
class Drives:
    """What was found about all drives.

    Attributes:
        unit: of the command, and why.
        joints: one drive for each joint.
        gravity: in the base frame, shape (3,) [m/s^2].
        gravity_reason: why it is not the usual one; empty where it is.
        held: whether each value of the command acts until the next one; else it was measured.
    """

    unit: tuple[str, str]
    joints: list[DriveValues]
    gravity: Array
    gravity_reason: str = ""
    held: bool = True


def find_drives(
    tree: RigidTree,
    encoder: Stream,
    command: Stream,
    sigmas: Array,
    *,
    held: bool = True,
    elastic: Sequence[str] = (),
    unit: str = "",
    links: Links | None = None,
) -> Drives:
    """Unit of the command and the drive of every joint.

    Args:
        tree: the robot, with masses.
        encoder: positions of the motors [rad].
        command: what drives them.
        sigmas: noise of the encoders, shape (n,) [rad].
        held: whether a command acts until the next one; else it was measured and is linear between samples.
        elastic: joints with a spring between motor and link.
        unit: of the command, if it is known.
        links: what encoders on links behind springs saw; the equation then holds whatever the springs are.
    """
    cells, of_links = Driven(encoder, command, links=links).cells(sigmas, held)
    M = tree.mass_matrix(of_links.q[:1])[0]
    springs = elastic
    if links is not None:
        elastic = ()

    def equations_of(tree: RigidTree) -> list[DriveEquation]:
        by_width = equations_by_width(cells, load_of(tree, of_links), M, sigmas, SHARPNESS, links)
        return [
            best_width({w: e for w, e in some.items() if w >= SOFT or joint not in elastic})
            for joint, some in zip(tree.joints, by_width, strict=True)
        ]

    tree, equations, reason = clearer_gravity(tree, equations_of)
    directions = [_direction(equation.direction(), equation.solve().get(GAIN)) for equation in equations]
    gains = [_gain(equation, sign) for equation, (sign, _) in zip(equations, directions, strict=True)]
    inertias = np.diag(M).tolist()
    heavy = [
        joint
        for joint, equation, (sign, _), link in zip(tree.joints, equations, directions, inertias, strict=True)
        if _needs_more_than_newton_metres(equation, sign, link)
    ]
    largest = float(np.nanmax(np.abs(command.values), initial=0.0))
    massless = all(equation.carries_nothing for equation in equations)
    told = (unit, TYPED) if unit else drive_unit(tree.joints, gains, largest, heavy, massless=massless)
    known = {GAIN: 1.0} if told[0] == "N m" else {}
    like = [0.0] * tree.n
    for _ in range(2):  # then with constants of neighbours, where a joint's own cannot be told
        drives = [
            _drive(equation, known, direction, link, joint in elastic, own)
            for joint, equation, direction, link, own in zip(
                tree.joints, equations, directions, inertias, like, strict=True
            )
        ]
        if not any(drive.unknown_scale for drive in drives):
            break
        like = _like_neighbours(drives)
    shown = turning_over(tree, equations, slope_noise(encoder, sigmas), springs)
    drives = [replace(drive, sharpness=k) for drive, k in zip(drives, shown, strict=True)]
    if links is not None:
        told_springs = first_springs(cells, of_links, load_of(tree, of_links))
        drives = [replace(drive, spring=s, own_links=True) for drive, s in zip(drives, told_springs, strict=True)]
    return Drives(told, drives, tree.gravity, reason, held)


def _like_neighbours(drives: Sequence[DriveValues]) -> list[float]:
    """Constant of the nearest joint whose own is told, shape (n,); 0 without any. Drives of one arm are alike."""
    told = [j for j, drive in enumerate(drives) if not drive.unknown_scale]
    return [drives[min(told, key=lambda k: abs(k - j))].start[GAIN] if told else 0.0 for j in range(len(drives))]


def _needs_more_than_newton_metres(equation: DriveEquation, sign: float, link: float) -> bool:
    """Whether a command in N m would be too little: the rotor's inertia would be far below zero."""
    values = equation.solve({GAIN: sign})
    inertia = values.get(INERTIA)
    if inertia is None or inertia.value > -max(SURE * inertia.sigma, HEAVY * link):
        return False
    plain = {GAIN: sign, **{name: value.value for name, value in values.items()}}
    return equation.missing(plain) ** 2 < (1.0 - EXPLAINED) * equation.torque(1.0) ** 2


def find_signs(encoder: Stream, command: Stream, sigmas: Array, torque: Stream | None, gravity: Array) -> Drives:
    """The same for a robot whose masses are not known: signs, and the unit by size; only ratios could be found.

    Args:
        encoder: positions of the motors [rad].
        command: what drives them.
        sigmas: noise of the encoders, shape (n,) [rad].
        torque: measured behind the motors, where it is.
        gravity: in the base frame, shape (3,) [m/s^2].
    """
    cells = motion_cells(encoder, command, sigmas)
    n = cells.q.shape[1]
    load = cells.a
    if torque is not None:
        load = np.column_stack([np.interp(cells.times, torque.times, column) for column in torque.values.T])
    by_width = equations_by_width(cells, load, np.eye(n), 0.0 * sigmas, SHARPNESS)
    ones = dict.fromkeys((GAIN, *PLACES), 1.0)
    pulls = [max((e.direction() for e in some.values()), key=lambda pull: abs(_ratio(pull))) for some in by_width]
    directions = [_direction(pull) for pull in pulls]
    unit = drive_unit([""] * n, [None] * n, float(np.nanmax(np.abs(command.values), initial=0.0)))
    joints = [DriveValues(ones, sign=sign, confidence=confidence) for sign, confidence in directions]
    return Drives(unit, joints, gravity)


def _ratio(value: Value) -> float:
    return value.value / value.sigma if value.sigma > 0.0 else 0.0


def _direction(pull: Value, gain: Value | None = None) -> tuple[float, float]:
    """Sign of a command against its joint, and its distance from the other one in sigmas; the surer of two tells."""
    distance = max((_ratio(value) for value in (pull, gain) if value is not None), key=abs)
    return (-1.0 if distance < -OPPOSITE else 1.0), abs(distance)


def _gain(equation: DriveEquation, sign: float) -> Value | None:
    """Torque per unit of the command; None where too much torque stays unexplained to conclude a unit from it."""
    values = equation.solve()
    gain = values.get(GAIN)
    if gain is None:
        return None
    missing = equation.missing({name: value.value for name, value in values.items()})
    if missing**2 > (1.0 - TRUSTED) * equation.torque(gain.value) ** 2:
        return None
    return Value(sign * gain.value, gain.sigma)


def _drive(
    equation: DriveEquation,
    known: Mapping[str, float],
    direction: tuple[float, float],
    link: float,
    elastic: bool,
    like: float,
) -> DriveValues:
    """A drive; where nothing tells its constant, with `like`, or for 0 with a rotor as heavy as what it moves."""
    sign, confidence = direction
    given = {name: sign * value for name, value in known.items()}
    found = equation.solve(given)
    guessed = not given and (GAIN not in found or found[GAIN].value * sign <= TOLD * found[GAIN].sigma)
    if guessed and (like or equation.carries_nothing):
        given = {GAIN: sign * (like or 1.0)}
        found = equation.solve(given)
    elif guessed:
        given = {INERTIA: MATCHED * link}
        found = {**equation.solve(given), INERTIA: Value(MATCHED * link, np.inf)}
    gain = given.get(GAIN, found.get(GAIN, Value(0.0, np.inf)).value)
    if gain * sign <= 0.0:
        gain = sign * (float(equation.rms[1] / equation.rms[0]) if np.all(equation.rms[:2] > 0.0) else 1.0)
    plain = {**{name: value.value for name, value in found.items()}, GAIN: gain}
    driving = equation.torque(gain)
    explained = 1.0 - (equation.missing(plain) / driving) ** 2 if found and driving > 0.0 else 0.0
    # where the unit is N m, the constant was tested all the same
    found |= {name: value for name, value in equation.solve().items() if name == GAIN and not guessed}
    turned = {n: Value(sign * x.value if n == GAIN else x.value, x.sigma) for n, x in found.items()}
    start = {GAIN: abs(gain), **_above_zero(equation, found, abs(gain))}
    inertia = found.get(INERTIA)
    hidden = inertia is not None and inertia.value < -TOLD * inertia.sigma and explained < EXPLAINED  # by a spring
    if elastic or inertia is None or hidden:
        start[INERTIA] = max(start[INERTIA], MATCHED * link)
    return DriveValues(start, turned, explained, sign, confidence, link, guessed)


def _above_zero(equation: DriveEquation, found: Mapping[str, Value], gain: float) -> dict[str, float]:
    """Start values of all but the gain: as found, or so large that they explain a little of the torque."""
    torque = gain * float(equation.rms[0]) or 1.0
    starts = {}
    for name, place in PLACES.items():
        size = float(equation.rms[place])
        least = SMALLEST * torque / (size if size > 0.0 else 1.0)
        value = found.get(name, Value(0.0, np.inf))
        starts[name] = value.value if value.value > TOLD * value.sigma else max(value.value, least)
    return starts
