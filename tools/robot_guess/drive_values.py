# SPDX-License-Identifier: BSD-3-Clause
"""Start values of the drives, the signs and the unit of their commands, from the regression on the recorded motion.

What the regression cannot tell from zero gets a small start above zero, and is marked as lost: its prior is wide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.starts.drive_regression import (
    GAIN,
    INERTIA,
    PLACES,
    DriveEquation,
    Value,
    best_width,
    equations_by_width,
    load_of,
)
from jointscope.graphs.starts.motion_cells import motion_cells
from jointscope.robots.recording import Stream
from jointscope.robots.rigid_tree import RigidTree
from jointscope.tools.robot_guess.drive_unit import drive_unit

Array = NDArray[np.float64]

OPPOSITE = 10.0  # [sigma] from which a motor turns against its command
TOLD = 2.0  # [sigma] above zero from which a value is one
SMALLEST = 0.02  # of the rms torque that a start value explains at least: it must be above zero
MATCHED = 0.3  # of the link's inertia that a motor behind a gear has at least where springs hide it, or nothing tells
SHARPNESS = 1e4  # [s/rad] of the sign of a velocity
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
        unknown_scale: whether all values are relative to a guessed rotor inertia, as the recording gives ratios only.
    """

    start: Mapping[str, float]
    found: Mapping[str, Value] = field(default_factory=dict)
    explained: float = 0.0
    sign: float = 1.0
    confidence: float = 0.0
    link: float = 1.0
    unknown_scale: bool = False

    def is_lost(self, name: str) -> bool:
        """Whether the regression cannot tell a value from zero."""
        value = self.found.get(name)
        return value is None or self.unknown_scale or value.value <= TOLD * value.sigma


def find_drives(
    tree: RigidTree,
    encoder: Stream,
    command: Stream,
    sigmas: Array,
    *,
    held: bool = True,
    elastic: Sequence[str] = (),
) -> tuple[tuple[str, str], list[DriveValues]]:
    """Unit of the command with its reason, and the drive of every joint.

    Args:
        tree: the robot, with masses.
        encoder: positions of the motors [rad].
        command: what drives them.
        sigmas: noise of the encoders, shape (n,) [rad].
        held: whether a command acts until the next one; else it was measured and is linear between samples.
        elastic: joints with a spring between motor and link.
    """
    cells = motion_cells(encoder, command, sigmas, held)
    M = tree.mass_matrix(cells.q[:1])[0]
    by_width = equations_by_width(cells, load_of(tree, cells), M, sigmas, SHARPNESS)
    soft = [
        {w: e for w, e in some.items() if w >= SOFT or j not in elastic}
        for j, some in zip(tree.joints, by_width, strict=True)
    ]
    equations = [best_width(some) for some in soft]
    directions = [_direction(equation.direction(), equation.solve().get(GAIN)) for equation in equations]
    gains = [_gain(equation, sign) for equation, (sign, _) in zip(equations, directions, strict=True)]
    unit = drive_unit(tree.joints, gains, float(np.nanmax(np.abs(command.values), initial=0.0)))
    known = {GAIN: 1.0} if unit[0] == "N m" else {}
    drives = [
        _drive(equation, known, direction, float(link), joint in elastic)
        for joint, equation, direction, link in zip(tree.joints, equations, directions, np.diag(M), strict=True)
    ]
    return unit, drives


def find_signs(
    encoder: Stream, command: Stream, sigmas: Array, torque: Stream | None
) -> tuple[tuple[str, str], list[DriveValues]]:
    """The same for a robot whose masses are not known: signs, and the unit by size; only ratios could be found.

    Args:
        encoder: positions of the motors [rad].
        command: what drives them.
        sigmas: noise of the encoders, shape (n,) [rad].
        torque: measured behind the motors, where it is.
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
    return unit, [DriveValues(ones, sign=sign, confidence=confidence) for sign, confidence in directions]


def _ratio(value: Value) -> float:
    return value.value / value.sigma if value.sigma > 0.0 else 0.0


def _direction(pull: Value, gain: Value | None = None) -> tuple[float, float]:
    """Sign of a command against its joint, and its distance from the other one in sigmas; the surer of two tells."""
    distance = max((_ratio(value) for value in (pull, gain) if value is not None), key=abs)
    return (-1.0 if distance < -OPPOSITE else 1.0), abs(distance)


def _gain(equation: DriveEquation, sign: float) -> Value | None:
    gain = equation.solve().get(GAIN)
    return None if gain is None else Value(sign * gain.value, gain.sigma)


def _drive(
    equation: DriveEquation, known: Mapping[str, float], direction: tuple[float, float], link: float, elastic: bool
) -> DriveValues:
    sign, confidence = direction
    given = {name: sign * value for name, value in known.items()}
    found = equation.solve(given)
    guessed = not given and (GAIN not in found or found[GAIN].value * sign <= TOLD * found[GAIN].sigma)
    if guessed:
        given = {INERTIA: MATCHED * link}
        found = {**equation.solve(given), INERTIA: Value(MATCHED * link, np.inf)}
    gain = given.get(GAIN, found.get(GAIN, Value(0.0, np.inf)).value)
    if gain * sign <= 0.0:
        gain = sign * float(equation.rms[1] / equation.rms[0]) if equation.rms[0] > 0.0 else sign
    torque = abs(gain) * float(equation.rms[0])
    start = {GAIN: abs(gain)}
    for name, place in PLACES.items():
        least = (
            SMALLEST * torque / float(equation.rms[place]) if equation.rms[place] > 0.0 else SMALLEST * torque or 1.0
        )
        start[name] = max(found[name].value if name in found else 0.0, least)
    if elastic or INERTIA not in found:
        start[INERTIA] = max(start[INERTIA], MATCHED * link)
    plain = {**{name: value.value for name, value in found.items()}, GAIN: gain}
    driving = equation.torque(gain)
    explained = 1.0 - (equation.missing(plain) / driving) ** 2 if found and driving > 0.0 else 0.0
    # where the unit is N m, the constant was tested all the same
    found |= {name: value for name, value in equation.solve().items() if name == GAIN and not guessed}
    turned = {n: Value(sign * x.value if n == GAIN else x.value, x.sigma) for n, x in found.items()}
    return DriveValues(start, turned, explained, sign, confidence, link, guessed)
