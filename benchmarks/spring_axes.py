# SPDX-License-Identifier: BSD-3-Clause
"""Axes whose motor moves its load through a spring that nobody declared, and the same axes without one.

    motor:  b a_m = k u - coulomb sign(v_m) - viscous v_m - tau + w
    load:   J a_l = tau - c sin(q_l),   tau = K (q_m - q_l) + D (v_m - v_l)

with w a random torque with a memory and a friction that holds what stands. Only the motor has an encoder. Runge and
Kutta's rule between the events; nothing is shared with the estimator.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from arm_recording import Topic, write_topics
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 5e-5  # [s] of the integration
MEMORY = 0.05  # [s] of the random torque
RATE = 1000.0  # [Hz] of command and encoder
FIRST_SAMPLE = 1e-3  # [s] of the encoder after the first command: half a tick beside it for no one
FASTEST = 2.0 * np.pi * 4.0  # [rad/s] of the position controller
JERK = 0.03  # [s] over which accelerations of the wanted motion are averaged
GRAVITY = 9.81


@dataclass(frozen=True)
class SpringAxis:
    """One axis; units of a slide are m, N, kg where those of a joint that turns are rad, N m, kg m2.

    Attributes:
        name: of the case.
        slides: whether it is a slide.
        motor, load: inertia of each.
        frequency: of the load on its spring with the motor held [Hz]; 0 for a rigid axis.
        damping_ratio: of that.
        coulomb, viscous: friction of the motor, in parts of the largest acceleration's torque.
        weight: of the load on a horizontal axis, in the same parts; turns alone.
        random: of the random torque, in parts of the same.
        noise: standard deviation of the encoder [m or rad].
        stroke, speed, acceleration: of the wanted motion.
        seed: of all that is random.
    """

    name: str
    slides: bool
    motor: float
    load: float
    frequency: float
    damping_ratio: float
    coulomb: float
    viscous: float
    weight: float
    random: float
    noise: float
    stroke: float
    speed: float
    acceleration: float
    seed: int
    kind = "spring"

    @property
    def truth(self) -> tuple[str, ...]:
        """ID@OWNER of what a rigid model with viscous friction lacks."""
        return ("joint_elasticity@axis",) if self.frequency else ()

    @property
    def force(self) -> float:
        """Torque of the largest acceleration."""
        return (self.motor + self.load) * self.acceleration

    @property
    def stiffness(self) -> float:
        """Of the spring; 0 for a rigid axis."""
        return self.load * (2.0 * np.pi * self.frequency) ** 2

    @property
    def compliance(self) -> float:
        """Of the spring."""
        return 1.0 / self.stiffness


FREQUENCIES = (6.0, 7.5, 9.0, 12.0, 15.0, 18.0, 22.0, 27.0, 33.0, 40.0)  # [Hz]


def spring_axes(seed: int) -> list[SpringAxis]:
    """Ten elastic axes and the same ten without their springs, slides and joints, quiet and noisy in turn."""
    found = []
    for rigid in (False, True):
        for i, frequency in enumerate(FREQUENCIES):
            rng = np.random.default_rng(seed + i)
            slides, noisy = i % 2 == 0, i % 4 in (1, 2)
            size = rng.uniform(10.0, 100.0) if slides else 10.0 ** rng.uniform(-2.0, 0.3)
            share = rng.uniform(0.3, 0.75)  # of the load
            stroke = rng.uniform(0.2, 0.6) if slides else rng.uniform(1.0, 2.5)
            acceleration = rng.uniform(3.0, 8.0) if slides else rng.uniform(20.0, 80.0)
            kind = "rigid" if rigid else f"{frequency:g} Hz"
            found.append(
                SpringAxis(
                    name=f"{'slide' if slides else 'wheel'} {i}, {'noisy' if noisy else 'quiet'}, {kind}",
                    slides=slides,
                    motor=(1.0 - share) * size,
                    load=share * size,
                    frequency=0.0 if rigid else frequency,
                    damping_ratio=10.0 ** rng.uniform(-2.0, -1.0),
                    coulomb=rng.uniform(0.03, 0.12),
                    viscous=rng.uniform(0.02, 0.08),
                    weight=0.0 if slides or i % 3 else 0.5,
                    random=rng.uniform(0.002, 0.006),
                    noise=(2e-6 if noisy else 5e-8) if slides else (3e-5 if noisy else 1e-6),
                    stroke=stroke,
                    speed=0.35 * np.sqrt(acceleration * stroke) * rng.uniform(1.0, 2.0),
                    acceleration=acceleration,
                    seed=seed + i + (100 if rigid else 0),
                )
            )
    return found


def record_axis(axis: SpringAxis, folder: Path, seconds: float, occasion: int = 0) -> Path:
    """Writes axis.urdf, truth.json and a bag of one occasion into a folder; returns the path of the bag."""
    rng = np.random.default_rng([axis.seed, occasion])
    ticks = np.arange(int(seconds * RATE)) / RATE
    q_ref, v_ref, a_ref = moves_between_goals(axis, ticks, rng)
    fine = round(1.0 / (RATE * STEP))
    torque = coloured_torque(axis.random * axis.force, len(ticks), rng)
    read = axis.noise * rng.standard_normal(len(ticks))
    frictions = axis.coulomb * axis.force, axis.viscous * axis.force / axis.speed
    spring = np.array([axis.stiffness, 2.0 * axis.damping_ratio * np.sqrt(axis.stiffness * axis.load)])
    u, q = _run(
        np.array([axis.motor, axis.load]),
        spring,
        np.array([*frictions, axis.weight * axis.force]),
        np.array([FASTEST**2, 1.4 * FASTEST]) * (axis.motor + axis.load),
        np.column_stack([q_ref, v_ref, a_ref]),
        torque,
        read,
        axis.noise,
        fine,
    )
    truth = asdict(axis) | {"compliance": axis.compliance if axis.frequency else 0.0, "damping": float(spring[1])}
    return write_axis(folder, axis_urdf(axis), truth, occasion, (ticks + FIRST_SAMPLE, q, u))


def write_axis(
    folder: Path, urdf: str, truth: Mapping[str, Any], occasion: int, motion: tuple[Array, Array, Array]
) -> Path:
    """The URDF, the truth and the bag of one axis.

    Args:
        folder: for all of them; made where it is missing.
        urdf: its text.
        truth: what the simulation used.
        occasion: 0 for the recording to learn from, others for those held out.
        motion: stamps [s], positions and efforts, shape (m,) each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "axis.urdf").write_text(urdf, encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")
    bag = folder / f"{'train' if occasion == 0 else f'test{occasion}'}.mcap"
    stamps, q, u = motion
    write_topics(
        bag,
        [
            Topic("/joint_states", stamps, ("axis",), {"position": q[:, None]}),
            Topic("/motor_command", stamps, ("axis",), {"effort": u[:, None]}),
        ],
    )
    return bag


def moves_between_goals(axis: SpringAxis, ticks: Array, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Moves between random goals with bounded speed and acceleration, averaged over a short time; with rests."""
    h, a_ref = 1.0 / RATE, np.zeros(len(ticks))
    q, k = 0.0, int(0.3 * RATE)
    while k < len(ticks):
        goal = rng.uniform(-0.5, 0.5) * axis.stroke
        speed, acceleration = axis.speed * rng.uniform(0.4, 1.0), axis.acceleration * rng.uniform(0.5, 1.0)
        way = abs(goal - q)
        rise = min(speed / acceleration, np.sqrt(way / acceleration))
        up = max(int(rise * RATE), 1)
        hold = max(int((way / (acceleration * rise) - rise) * RATE), 0)
        move = np.concatenate([np.ones(up), np.zeros(hold), -np.ones(up)]) * np.sign(goal - q)
        size = way / max(abs(float(np.sum(np.cumsum(move)))) * h * h, 1e-12)
        end = min(k + len(move), len(ticks))
        a_ref[k:end] = size * move[: end - k]
        q, k = goal, k + len(move) + int(rng.uniform(0.05, 0.4) * RATE)
    n = int(JERK * RATE)
    a = np.convolve(a_ref, np.ones(n) / n)[: len(ticks)]
    v = np.cumsum(a) * h
    return np.cumsum(v) * h, v, a


def coloured_torque(size: float, n: int, rng: np.random.Generator) -> Array:
    """A Gauss-Markov torque at the ticks, shape (n,)."""
    keep, torque, white = np.exp(-1.0 / (RATE * MEMORY)), np.empty(n), rng.standard_normal(n)
    torque[0] = size * white[0]
    for i in range(1, n):
        torque[i] = keep * torque[i - 1] + size * np.sqrt(1.0 - keep**2) * white[i]
    return torque


@njit(cache=True)
def _run(inertia, spring, friction, gains, wanted, torque, read, grid, fine):
    """Commands and readings at the ticks; the command reacts to the reading."""
    n, x, h = len(wanted), np.zeros(4), STEP
    u, readings = np.empty(n), np.empty(n)
    last = 0.0
    for k in range(n):
        q = grid * np.round((x[0] + read[k]) / grid)
        rate = (q - last) * RATE if k else 0.0
        last = q
        sign = np.sign(wanted[k, 1])
        weight = friction[2] * np.sin(wanted[k, 0])
        u[k] = (inertia[0] + inertia[1]) * wanted[k, 2] + friction[0] * sign + friction[1] * wanted[k, 1] + weight
        u[k] += gains[0] * (wanted[k, 0] - q) + gains[1] * (wanted[k, 1] - rate)
        readings[k] = q
        for _ in range(fine):
            x = _advanced(x, inertia, spring, friction, u[k] + torque[k], h)
    return u, readings


@njit(cache=True)
def _advanced(x, inertia, spring, friction, drive, h):
    """State after a step in which friction keeps its direction; where the motor would turn over it stands first."""
    direction = np.sign(x[1])
    if direction == 0.0:
        push = drive - _reaction(x, inertia, spring, friction)
        if abs(push) > friction[0]:
            direction = np.sign(push)
    k1 = _rates(x, inertia, spring, friction, drive, direction)
    k2 = _rates(x + 0.5 * h * k1, inertia, spring, friction, drive, direction)
    k3 = _rates(x + 0.5 * h * k2, inertia, spring, friction, drive, direction)
    k4 = _rates(x + h * k3, inertia, spring, friction, drive, direction)
    y = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    if direction * y[1] < 0.0:
        y[1] = 0.0
    return y


@njit(cache=True)
def _reaction(x, inertia, spring, friction):
    """Torque by which the load holds the motor back when it stands, or the weight of a rigid one."""
    if spring[0] == 0.0:
        return friction[2] * np.sin(x[0])
    return spring[0] * (x[0] - x[2]) + spring[1] * (x[1] - x[3])


@njit(cache=True)
def _rates(x, inertia, spring, friction, drive, direction):
    push = drive - _reaction(x, inertia, spring, friction) - friction[0] * direction - friction[1] * x[1]
    if spring[0] == 0.0:
        a = push / (inertia[0] + inertia[1]) if direction != 0.0 else 0.0
        return np.array([x[1], a, x[1], a])
    tau = spring[0] * (x[0] - x[2]) + spring[1] * (x[1] - x[3])
    a = push / inertia[0] if direction != 0.0 else 0.0
    return np.array([x[1], a, x[3], (tau - friction[2] * np.sin(x[2])) / inertia[1]])


def axis_urdf(axis: SpringAxis) -> str:
    kind = "prismatic" if axis.slides else "revolute"
    arm = axis.weight * axis.force / GRAVITY  # m r
    mass = axis.load if axis.slides else max(1.0, 2.0 * arm**2 / axis.load)
    middle = axis.load - arm**2 / mass if not axis.slides else axis.load
    # the axis is y where there is a weight: the load hangs below it at zero
    direction = "1 0 0" if axis.slides else ("0 1 0" if axis.weight else "0 0 1")
    return f"""<robot name="axis">
<link name="base"/>
<link name="load"><inertial><origin xyz="0 0 {-arm / mass!r}"/><mass value="{mass!r}"/>
<inertia ixx="{middle!r}" iyy="{middle!r}" izz="{middle!r}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="axis" type="{kind}"><parent link="base"/><child link="load"/><axis xyz="{direction}"/>
<limit lower="-6" upper="6" effort="1e5" velocity="1e3"/></joint>
</robot>
"""
