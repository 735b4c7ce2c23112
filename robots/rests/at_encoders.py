# SPDX-License-Identifier: BSD-3-Clause
"""What encoders read of robots at rest, and which commands act, with the effects that the robot has there.

reading = q + errors(q)           of motor encoders, owner JOINT, or of those on the links, JOINT.link
u_acting = law(u)                 of a command that has been held for long
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
STEP = 1e-30  # of complex derivatives
LONG = 1e3  # [s] after which what happens to a held command has happened
ROUNDS = 4  # of positions and the errors of their readings, which are small


@dataclass(frozen=True)
class EncoderErrors:
    """Errors of m readings of one encoder on each joint.

    Attributes:
        value: shape (m, n) [rad].
        by_position: derivative by the own position, shape (m, n).
        by_parameter: by each parameter, by full name, shape (m, n).
    """

    value: Array
    by_position: Array
    by_parameter: dict[str, Array]


def encoder_errors(robot: Robot, q: Array, values: Mapping[str, float], on_links: bool) -> EncoderErrors:
    """Errors of readings that effects make.

    Args:
        robot: with its effects.
        q: true positions, shape (m, n) [rad].
        values: parameters by full name.
        on_links: whether encoders of links are meant.
    """
    found = EncoderErrors(np.zeros_like(q), np.zeros_like(q), {})
    time = np.zeros(len(q))
    for here in robot.effects:
        joint = here.owner.removesuffix(LINK_SIDE)
        if not isinstance(here.effect, ReadingEffect) or here.owner.endswith(LINK_SIDE) != on_links:
            continue
        if joint not in robot.joints:
            continue
        j, p, law = robot.joints.index(joint), here.own(values), here.effect.law
        error = np.asarray(law(q[:, [j]] + 1j * STEP, time, p))[:, 0]
        found.value[:, j] += error.real
        found.by_position[:, j] += error.imag / STEP
        for name, value in p.items():
            slope = np.asarray(law(q[:, [j]], time, {**p, name: value + 1j * STEP}))[:, 0].imag / STEP
            found.by_parameter.setdefault(here.parameter(name), np.zeros_like(q))[:, j] = slope
    return found


def true_positions(robot: Robot, readings: Array, values: Mapping[str, float], on_links: bool) -> Array:
    """Positions that encoders with errors read so; arguments as of `encoder_errors`."""
    q = readings
    if any(isinstance(here.effect, ReadingEffect) for here in robot.effects):
        for _ in range(ROUNDS):
            q = readings - encoder_errors(robot, q, values, on_links).value
    return q


def acting_commands(robot: Robot, u: Array, values: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """Commands that act, of those that were held at rest, and derivatives by parameters, by full name, shape (m, n)."""
    path = CommandPath(LONG * np.arange(2.0 * len(u) + 1.0), np.repeat(u, 2, axis=0), robot.effects, robot.joints)
    if not path.changes:
        return u, {}
    acting, slopes = path.acting(values)
    return acting[1::2], {name: slope[1::2] for name, slope in slopes.items()}
