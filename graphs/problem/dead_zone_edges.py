# SPDX-License-Identifier: BSD-3-Clause
"""Where springs meet the edges of their dead zones, within a small part of a step.

Spring and damper come in, and go out again, within microseconds. A step of a millisecond over an edge misses part of
the blow: predictions go astray there, and a collocation takes it for random torque, which then is everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import Transmission
from jointscope.robots.effect_kinds.joint_torque import GAP_CORNER, JointTorque
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

PARTS = 8  # of a step that meets an edge; errors are then below the noise of encoders
SUDDEN = 0.5 * GAP_CORNER  # [rad] less in a step, and the step follows the rounded corner as it is


@dataclass(frozen=True)
class DeadZoneEdges:
    """The dead zones of a robot with its present parameters.

    Attributes:
        deflections: what each spring's deflection is of a state, shape (d, k).
        edges: where each dead zone begins and where it ends, shape (2, k) [rad].
    """

    deflections: Array
    edges: Array

    @staticmethod
    def of(robot: Robot) -> DeadZoneEdges | None:
        """None where no spring has a dead zone, or the integrator is one that a robot file asks for as it is."""
        values, transmission, layout = robot.values, Transmission.of(robot), robot.layout
        rows, edges = list[Array](), list[tuple[float, float]]()
        S = np.eye(layout.size) if transmission is None else transmission.maps(values)[0]
        for j, begin, end in dead_zones(robot):
            rows.append(S[layout.joint_q[j]] - S[layout.motor_q[j]])
            edges.append((begin, end))
        if not rows or robot.choices.integrator != "simpson":
            return None
        return DeadZoneEdges(np.array(rows).T, np.array(edges).T)

    def met(self, before: Array, after: Array) -> NDArray[np.bool_]:
        """Whether steps reach into a rounded corner and move far in it.

        Args:
            before: states where they begin, shape (s, d).
            after: states where they end, shape (s, d).

        Returns:
            Shape (s,).
        """
        begin, end = before @ self.deflections, after @ self.deflections
        low, high = np.minimum(begin, end) - GAP_CORNER, np.maximum(begin, end) + GAP_CORNER
        reached = np.any((low < self.edges[:, None]) & (self.edges[:, None] < high), axis=0)
        return np.asarray(np.any(reached & (np.abs(end - begin) > SUDDEN), axis=1))

    def times(self, ticks: Array, x: Array, known: Array) -> Array:
        """Times that divide the steps which meet an edge, shape (k,) [s].

        Args:
            ticks: shape (m + 1,) [s].
            x: states, shape (m + 1, d).
            known: ticks that divide steps already, shape (j,) [s].
        """
        short = np.isin(ticks[:-1], known) | np.isin(ticks[1:], known)
        hit = self.met(x[:-1], x[1:]) & ~short
        return (ticks[:-1][hit, None] + np.diff(ticks)[hit, None] * np.arange(1, PARTS) / PARTS).ravel()


def dead_zones(robot: Robot) -> list[tuple[int, float, float]]:
    """Joint whose spring has a dead zone, and where that begins and ends [rad]."""
    values, found = robot.values, []
    for here in robot.effects:
        if isinstance(here.effect, JointTorque) and here.effect.gap:
            sizes = [values[here.parameter(name)] for name in here.effect.gap]
            if any(sizes):
                found.append((robot.joints.index(here.owner), -sizes[0], sizes[-1]))
    return found
