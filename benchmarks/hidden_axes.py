# SPDX-License-Identifier: BSD-3-Clause
"""Rigid slides and joints that lack one large thing, among what real machines have beside it.

    (m) a = u + w + ripple(q) + offset - weight sin(q) - F(v, q, t, a) sign(v)

with a random torque w that has a memory and a friction that holds what stands. What is hidden is one of a dozen; what
is around it is quiet, a louder random torque, or many small effects at once. Encoders are fine, noisy or coarse. The
friction's own model is that of none of the effects of the catalogue but where it is hidden. Nothing is shared with the
estimator: Heun's rule with stops at the events.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray
from spring_axes import axis_urdf, coloured_torque, moves_between_goals, write_axis

Array = NDArray[np.float64]
STEP = 1e-4  # [s] of the integration
EVERY = 4  # ticks of a millisecond in one of the controller and the recording
PERIOD = 4e-3  # [s] of these
FIRST_SAMPLE = 4e-3  # [s] of the encoder after the first command
SMOOTHED = 0.3  # weight of the newest slope of the encoder in the speed that the controller knows
STIFFNESS = 2.0 * np.pi * 4.0  # [rad/s] of the position controller
WAVES = 6  # of the ripple

# sizes in parts of the torque of the largest acceleration, or as they are
HIDDEN: dict[str, dict[str, float]] = {
    "torque_offset": {"offset": 0.04},
    "asymmetric_friction": {"backwards": 0.06},
    "friction_by_direction": {"viscous_backwards": 0.10},
    "motor_stribeck": {"stribeck": 0.05},
    "cogging": {"cogging": 0.05},
    "load_dependent_friction": {"load": 0.12},
    "gravity_imbalance": {"imbalance": 0.08},
    "command_delay": {"delay": 6.0},
    "position_dependent_friction": {"stretch": 0.10},
    "warming_friction": {"warming": 0.06},
    "joint_stop": {"stop": 0.3},
    "": {},
}
# not in the catalogue, or not for a rigid joint: of these friction grows with the weight alone
OUTSIDE = ("position_dependent_friction", "warming_friction", "joint_stop", "load_dependent_friction")
AROUND = {  # random torque and ripple in the same parts, share of a Stribeck effect and an offset beside it
    "quiet": (0.002, 0.0, 0.0),
    "coloured": (0.015, 0.002, 0.0),
    "many small": (0.004, 0.005, 0.003),
}
NOISE = {"fine": (2e-8, 1e-6), "noisy": (2e-6, 5e-5), "coarse": (2e-5, 4e-4)}  # [m], [rad]


@dataclass(frozen=True)
class HiddenAxis:
    """One axis; units of a slide are m, N, kg where those of a joint that turns are rad, N m, kg m2."""

    name: str
    hidden: str
    around: str
    slides: bool
    inertia: float
    coulomb: float
    viscous: float
    noise: float
    stroke: float
    speed: float
    acceleration: float
    seed: int
    sizes: dict[str, float] = field(default_factory=dict)
    load = property(lambda self: self.inertia)  # of the URDF
    weight = 0.0
    kind = "axis"

    @property
    def truth(self) -> tuple[str, ...]:
        """ID@OWNER of what the model lacks, as far as the catalogue has it."""
        return (f"{self.hidden}@axis",) if self.hidden and self.hidden not in OUTSIDE else ()

    @property
    def force(self) -> float:
        """Torque of the largest acceleration."""
        return self.inertia * self.acceleration


def hidden_axes(seed: int) -> list[HiddenAxis]:
    """Every hidden thing once, slides and joints, surroundings and encoders in turn; another seed turns them anew."""
    found = []
    grades = list(NOISE)
    for i, hidden in enumerate(HIDDEN):
        rng = np.random.default_rng([seed, i])
        slides = bool((i + seed) % 2) and hidden != "gravity_imbalance"
        around = list(AROUND)[(i + seed) % 3]
        grade = grades[(i // 3 + seed) % 3] if hidden else "fine"
        size = rng.uniform(10.0, 100.0) if slides else 10.0 ** rng.uniform(-2.0, 0.3)
        stroke = rng.uniform(0.2, 0.6) if slides else rng.uniform(1.0, 2.5)
        acceleration = rng.uniform(0.5, 5.0) if slides else rng.uniform(10.0, 60.0)
        kind = "slide" if slides else "joint"
        found.append(
            HiddenAxis(
                name=f"{hidden or 'nothing'} on a {kind}, {around}, {grade} encoder (seed {seed})",
                hidden=hidden,
                around=around,
                slides=slides,
                inertia=size,
                coulomb=rng.uniform(0.05, 0.25),
                viscous=rng.uniform(0.03, 0.15),
                noise=NOISE[grade][0 if slides else 1],
                stroke=stroke,
                speed=0.35 * np.sqrt(acceleration * stroke) * rng.uniform(1.0, 2.0),
                acceleration=acceleration,
                seed=1000 * seed + i,
                sizes={name: s * rng.uniform(0.8, 1.3) for name, s in HIDDEN[hidden].items()},
            )
        )
    return found


def record_hidden(axis: HiddenAxis, folder: Path, seconds: float, occasion: int = 0) -> Path:
    """Writes axis.urdf, truth.json and a bag of one occasion into a folder; returns the path of the bag."""
    rng, body = np.random.default_rng([axis.seed, occasion]), np.random.default_rng([axis.seed, 77])
    fast = np.arange(int(seconds / PERIOD) * EVERY) * PERIOD / EVERY
    wanted, ticks = np.column_stack(moves_between_goals(axis, fast, rng))[::EVERY], fast[::EVERY]
    random, ripple, small = AROUND[axis.around]
    waves = _waves(axis, ripple, body)
    torque = coloured_torque(random * axis.force, len(fast), rng)[::EVERY]
    read = axis.noise * rng.standard_normal(len(ticks))
    force, own = axis.force, dict.fromkeys(("offset", "backwards", "viscous_backwards", "stribeck", "load"), 0.0)
    own |= dict.fromkeys(("imbalance", "delay", "stretch", "warming", "stop"), 0.0) | axis.sizes
    laws = np.array(
        [
            force * (own["offset"] + 0.5 * small),
            force * own["backwards"],
            force * own["viscous_backwards"] / axis.speed,
            force * (own["stribeck"] + small),
            0.05 * axis.speed,
            own["load"],
            force * own["imbalance"],
            own["delay"],
            force * own["stretch"],
            0.1 * axis.stroke,
            0.1 * axis.stroke,
            force * own["warming"],
            seconds / 2.0,
            force * own["stop"] / axis.stroke,
            0.2 * axis.stroke,
        ]
    )
    base = np.array([axis.inertia, axis.coulomb * force, axis.viscous * force / axis.speed])
    gains = np.array([STIFFNESS**2, 1.4 * STIFFNESS]) * axis.inertia
    u, q = _run(base, laws, waves, gains, wanted, torque, read, axis.noise, round(PERIOD / STEP))
    truth = asdict(axis) | {"coulomb": base[1], "viscous": base[2], "true": true_sizes(axis)}
    return write_axis(folder, axis_urdf(axis), truth, occasion, (ticks + FIRST_SAMPLE, q, u))


def true_sizes(axis: HiddenAxis) -> dict[str, float]:
    """What is hidden, by full name of the parameter that holds it; that of a ripple is its amplitude."""
    force, small, s = axis.force, AROUND[axis.around][2], axis.sizes
    found = {
        "torque_offset": {"torque": force * (s.get("offset", 0.0) + 0.5 * small)},
        "asymmetric_friction": {"torque": -0.5 * force * s.get("backwards", 0.0)},
        "friction_by_direction": {"coefficient": -0.5 * force * s.get("viscous_backwards", 0.0) / axis.speed},
        "motor_stribeck": {"torque": force * (s.get("stribeck", 0.0) + small), "velocity": 0.05 * axis.speed},
        "load_dependent_friction": {"coefficient": s.get("load", 0.0)},
        "gravity_imbalance": {"sin": -force * s.get("imbalance", 0.0)},
        "command_delay": {"delay": 1e-3 * s.get("delay", 0.0)},
    }
    return {f"axis.{axis.hidden}.{name}": value for name, value in found.get(axis.hidden, {}).items()}


def _waves(axis: HiddenAxis, ripple: float, rng: np.random.Generator) -> Array:
    """Cosine, sine and wave number of every wave, shape (WAVES + 1, 3); the last is the hidden one."""
    number = 2.0 * np.pi * np.geomspace(5.0, 60.0, WAVES + 1) * rng.uniform(0.9, 1.1, WAVES + 1) / axis.stroke
    phase = rng.uniform(0.0, 2.0 * np.pi, WAVES + 1)
    size = np.full(WAVES + 1, ripple * np.sqrt(2.0 / WAVES)) * axis.force
    size[-1], number[-1] = (
        axis.sizes.get("cogging", 0.0) * axis.force,
        2.0 * np.pi * rng.uniform(6.0, 20.0) / axis.stroke,
    )
    return np.column_stack([size * np.cos(phase), size * np.sin(phase), number])


@njit(cache=True)
def _run(base, laws, waves, gains, wanted, torque, read, grid, fine):
    """Commands and readings at the ticks; the command reacts to the reading."""
    n, q, v, h = len(wanted), 0.0, 0.0, STEP
    u, readings, last, rate = np.empty(n), np.empty(n), 0.0, 0.0
    sent = np.zeros(n * fine)
    late = round(1e-3 * laws[7] / h)
    for k in range(n):
        reading = grid * np.round((q + read[k]) / grid)
        rate = rate + SMOOTHED * ((reading - last) / PERIOD - rate) if k else 0.0
        last = reading
        u[k] = base[0] * wanted[k, 2] + base[1] * np.sign(wanted[k, 1]) + base[2] * wanted[k, 1]
        u[k] += gains[0] * (wanted[k, 0] - reading) + gains[1] * (wanted[k, 1] - rate)
        readings[k] = reading
        for i in range(fine):
            at = k * fine + i
            sent[at] = u[k]
            drive = (sent[at - late] if at >= late else 0.0) + torque[k]
            t = at * h
            if v == 0.0:
                push = _push(q, drive, laws, waves)
                if abs(push) <= _friction(q, 0.0, t, np.sign(push), base, laws):
                    continue
                direction = np.sign(push)
            else:
                direction = np.sign(v)
            a1 = _acceleration(q, v, t, direction, drive, base, laws, waves)
            a2 = _acceleration(q + h * v, v + h * a1, t + h, direction, drive, base, laws, waves)
            after = v + 0.5 * h * (a1 + a2)
            if direction * after < 0.0:
                after = 0.0
            q, v = q + 0.5 * h * (v + after), after
    return u, readings


@njit(cache=True)
def _push(q, drive, laws, waves):
    """All torques but friction."""
    push = drive + laws[0] - laws[6] * np.sin(q)
    for i in range(len(waves)):
        push += waves[i, 0] * np.cos(waves[i, 2] * q) + waves[i, 1] * np.sin(waves[i, 2] * q)
    if q > laws[14]:
        push -= laws[13] * (q - laws[14])
    return push


@njit(cache=True)
def _friction(q, v, t, direction, base, laws):
    """Dry friction where it slides, or where it is about to."""
    found = base[1] + laws[3] * np.exp(-((v / laws[4]) ** 2))
    if direction < 0.0:
        found += laws[1] + laws[2] * abs(v)
    if abs(q - laws[9]) < laws[10]:
        found += laws[8]
    return found + laws[11] * np.exp(-t / laws[12])


@njit(cache=True)
def _acceleration(q, v, t, direction, drive, base, laws, waves):
    push = _push(q, drive, laws, waves) - base[2] * v - _friction(q, v, t, direction, base, laws) * direction
    a = push / base[0]
    if laws[5] == 0.0:
        return a
    # a friction that grows with the torque m a that reaches the load: m a = push - load |m a| sign(v)
    return a / (1.0 + laws[5] * direction * np.sign(push))
