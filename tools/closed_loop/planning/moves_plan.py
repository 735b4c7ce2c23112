# SPDX-License-Identifier: BSD-3-Clause
"""Smooth moves of all joints at once, far out and back home, to one side and to the other: a benchmark of tracking."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.planning.passage import Passage
from jointscope.tools.closed_loop.planning.plan import Hit, Plan
from jointscope.tools.simulator.loop.motion import joint_span

Array = NDArray[np.float64]

REST, STAY = 0.5, 0.5  # [s] before the first move, at home after each
WAY = 1.5  # [s] out, and back again
REACH = (0.87, 0.97)  # of half the range of each joint


def moves_plan(robot: Robot, times: Array, home: Array, rng: np.random.Generator) -> Plan:
    """As many moves as there is time for; `hits` are their turning points.

    Args:
        robot: the model: its limits.
        times: of the ticks, shape (m,) [s].
        home: where the joints rest, shape (n_joints,) [rad].
        rng: draws the turning points.

    Raises:
        SimulationError: not even one move fits.
    """
    centre, amplitude = joint_span(robot)
    half = np.ptp(robot.tree.limits, axis=1) / 2.0
    half = np.where(np.isfinite(half) & (half < np.pi), half, amplitude)
    count = int((times[-1] - REST + 1e-9) / (2.0 * WAY + STAY))
    if count < 1:
        raise SimulationError(f"seconds: one move takes {REST + 2 * WAY + STAY:.1f} s, got {times[-1]:.1f}; give more")
    q, still, side = np.tile(home, (len(times), 1)), np.zeros(robot.n), rng.choice([-1.0, 1.0], robot.n)
    v, a, hits = np.zeros_like(q), np.zeros_like(q), list[Hit]()
    for k in range(count):
        t, there = REST + k * (2.0 * WAY + STAY), centre + side * rng.uniform(*REACH, robot.n) * half
        for begin, way in (
            (t, Passage(home, still, there, still, WAY)),
            (t + WAY, Passage(there, still, home, still, WAY)),
        ):
            now = (times >= begin) & (times <= begin + WAY)
            q[now], v[now], a[now] = (way.at(times[now] - begin, order) for order in range(3))
        hits.append(Hit(t, t + WAY, t + 2.0 * WAY, t + 2.0 * WAY + STAY, there, still))
        side = -side
    return Plan(times, q, v, a, home, tuple(hits))
