# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of rods whose links swing on when their motors stand, seen by encoders with coarse steps.

The equations of motion are those that a page works out, integrated here; angles count from hanging.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from lever_bench import C1, K2, K3, K
from numpy.typing import NDArray
from two_levers import STIFFNESS

from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.rests.load_history import LoadHistory

Array = NDArray[np.float64]
Law = Callable[[Array], Array]
G, RATE, SMALL = 9.81, 100.0, 1e-3  # [m/s^2], [Hz] of all streams, [s] of a step of integration
MOVES = 0.5  # [s] from one rest to the next
HELD = (1.0, 2.5)  # [s] of a rest
DRY = np.array([0.7, 0.4])  # [N m] of friction, which holds motors while links swing: more than springs take off
PULLS = (0.0, 4.0, 8.0, 12.0, -4.0, -8.0, -12.0)  # [N] sideways at the lever's hook


def swinging_lever(count: int, seed: int, step: float, swing: float) -> tuple[Recording, LoadHistory, Array]:
    """The lever of lever_bench.py with weights, the loads, and where it would come to rest, shape (count, 1) [rad].

    Args:
        count: number of rests.
        seed: of all that is drawn.
        step: of the encoder on the link [rad].
        swing: of the link as its motor stops, the largest [rad].
    """
    rng = np.random.default_rng(seed)
    pull = rng.choice(PULLS, count)
    rest = rng.uniform(-1.0, 1.0, (count, 1))

    def weight(q: Array) -> Array:
        return -2.0 * G * 0.3 * np.sin(q) - 0.5 * pull[:, None] * np.cos(q)

    def spring(d: Array) -> Array:
        return K * d + K2 * d**2 + K3 * d**3

    tau = weight(rest)
    bend = np.zeros_like(tau)
    for _ in range(50):  # Newton
        bend -= (spring(bend) - tau) / (K + 2.0 * K2 * bend + 3.0 * K3 * bend**2)
    motor = rest - bend

    def acceleration(q: Array, v: Array) -> Array:
        return (weight(q) - spring(q - motor) - 0.15 * v) / (0.02 + 2.0 * 0.3**2)

    def held(swung: Array) -> Array:
        return np.abs(spring(swung - motor) - tau)

    friction = DRY[0] + C1 * np.abs(tau)
    recording, begins = _recorded(rng, ("swing",), motor, rest, (tau, friction, held), acceleration, step, swing)
    forces = np.column_stack([pull, 0.0 * pull, 0.0 * pull])
    return recording, LoadHistory(begins, forces, ("hook",) * count), rest


def swinging_pair(count: int, seed: int, step: float, swing: float) -> tuple[Recording, LoadHistory, Array]:
    """The rods of two_levers.py without weights; arguments and results as above, shape (count, 2)."""
    rng = np.random.default_rng(seed)
    rest = np.column_stack([rng.uniform(-1.2, 1.2, count), rng.uniform(-1.5, 1.5, count)])

    def weight(q: Array) -> Array:
        lower = -G * 0.25 * np.sin(q[:, 0] + q[:, 1])
        return np.column_stack([-G * (2.0 * 0.2 + 0.4) * np.sin(q[:, 0]) + lower, lower])

    motor = rest - weight(rest) / STIFFNESS

    def acceleration(q: Array, v: Array) -> Array:
        c, s = 0.4 * 0.25 * np.cos(q[:, 1]), 0.4 * 0.25 * np.sin(q[:, 1])
        lower = 0.02 + 0.25**2
        m11, m12 = 0.02 + 2.0 * 0.2**2 + 0.4**2 + lower + 2.0 * c, lower + c
        force = weight(q) - STIFFNESS * (q - motor) - np.array([0.2, 0.05]) * v
        force[:, 0] += s * v[:, 1] * (2.0 * v[:, 0] + v[:, 1])
        force[:, 1] -= s * v[:, 0] ** 2
        det = m11 * lower - m12**2
        first = lower * force[:, 0] - m12 * force[:, 1]
        return np.column_stack([first, m11 * force[:, 1] - m12 * force[:, 0]]) / det[:, None]

    def held(swung: Array) -> Array:
        return STIFFNESS * np.abs(swung - rest)

    drives = (weight(rest), DRY, held)
    recording, _ = _recorded(rng, ("a", "b"), motor, rest, drives, acceleration, step, swing)
    return recording, LoadHistory.none(), rest


def _recorded(
    rng: np.random.Generator,
    joints: tuple[str, ...],
    motor: Array,
    rest: Array,
    drives: tuple[Array, Array, Callable[[Array], Array]],
    acceleration: Callable[[Array, Array], Array],
    step: float,
    swing: float,
) -> tuple[Recording, Array]:
    """Streams, and when the load of each rest begins to act [s].

    `drives` are torques on the links, what friction can hold, and what of it a swing takes for itself.
    """
    count = len(rest)
    held = np.round(rng.uniform(*HELD, count) * RATE).astype(int)
    q = rest + swing * rng.uniform(-1.0, 1.0, (count, 1)) * rng.uniform(0.5, 1.0, rest.shape)
    v, every, seen = np.zeros_like(q), round(1.0 / RATE / SMALL), []
    for k in range(int(held.max()) * every):
        if k % every == 0:
            seen.append(q)
        k1 = acceleration(q, v)
        k2 = acceleration(q + 0.5 * SMALL * v, v + 0.5 * SMALL * k1)
        k3 = acceleration(q + 0.5 * SMALL * (v + 0.5 * SMALL * k1), v + 0.5 * SMALL * k2)
        k4 = acceleration(q + SMALL * (v + 0.5 * SMALL * k2), v + SMALL * k3)
        q, v = q + SMALL * v + SMALL**2 / 6.0 * (k1 + k2 + k3), v + SMALL / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    swung, between = np.array(seen), int(MOVES * RATE)
    tau, friction, taken = drives
    u = -tau + (friction - np.max([taken(q) for q in swung], axis=0)) * rng.uniform(-1.0, 1.0, rest.shape)
    share = np.linspace(0.0, 1.0, between, endpoint=False)[:, None]
    sides: list[list[Array]] = [[], [], []]
    begins = np.cumsum([0, *(held[:-1] + between)]) / RATE - 0.5 * MOVES
    for k, length in enumerate(held.tolist()):
        last = (motor[k], swung[0, k], u[k]) if k == 0 else (motor[k - 1], sides[1][-1][-1], u[k - 1])
        stands = (np.tile(motor[k], (length, 1)), swung[:length, k], np.tile(u[k], (length, 1)))
        for side, before, there in zip(sides, last, stands, strict=True):
            if k:
                side.append(before + share * (there[0] - before))
            side.append(there)
    motors, links, commands = (np.concatenate(side) for side in sides)
    times = np.arange(len(motors)) / RATE
    motors = motors + 1e-6 * rng.normal(size=motors.shape)
    streams = {
        name: Stream(name, times, values, joints, unit)
        for name, values, unit in (
            ("command", commands, "N m"),
            ("motor_angle", motors, "rad"),
            ("link_angle", step * np.round(links / step), "rad"),
        )
    }
    return Recording("bench", "", 0, streams), begins
