# SPDX-License-Identifier: BSD-3-Clause
"""The drives of a simulated arm, which is what a calibration is to find: rotors, friction, torque per unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from arm_bodies import ArmBodies
from arm_motion import Motion
from numpy.typing import NDArray

Array = NDArray[np.float64]
SHARPNESS = 500.0  # [s/rad] dry friction is coulomb * tanh(SHARPNESS v): 90 % of it at 3 mrad/s
SMALLEST_ROTOR = {"turns": 1e-5, "slides": 1e-2}  # [kg m2], [kg]
LARGEST = {"A": (1.0, 8.0), "duty": (0.25, 0.6)}  # the command's largest value
DRY, DRY_STICKING = (0.02, 0.06), (0.04, 0.12)  # friction, of the largest torque
TELLING = 0.15  # part of the torque that must come from known masses for a torque constant to be found


@dataclass(frozen=True)
class Drives:
    """Truth of the joints that move, each of shape (n,).

    Attributes:
        inertia: of the rotors, on the side of the link [kg m2 or kg].
        coulomb: dry friction [N m or N].
        viscous: viscous friction [N m s/rad or N s/m].
        k: torque per unit of the command [N m/unit].
        sticks: whether dry friction holds a joint that stands, instead of turning over smoothly.
    """

    inertia: Array
    coulomb: Array
    viscous: Array
    k: Array
    sticks: bool = False

    def friction(self, v: Array) -> Array:
        """Torque against the motion, shape (n,)."""
        return self.coulomb * np.tanh(SHARPNESS * v) + self.viscous * v


@dataclass(frozen=True)
class Loads:
    """What a motion asks of the links, each of shape (times, n): torque without rotors, velocity, acceleration."""

    torque: Array
    v: Array
    a: Array


def loads(bodies: ArmBodies, motion: Motion, seconds: float) -> Loads:
    """Inverse dynamics of the links along the motion."""
    rows = []
    for t in np.linspace(0.0, seconds, 400):
        q, v, a = motion.at(float(t))
        M, bias = bodies.mass_and_bias(q, v)
        rows.append((M @ a + bias, v, a))
    return Loads(*(np.array(part) for part in zip(*rows, strict=True)))


def make_drives(
    load: Loads, link_inertia: Array, slides: Array, unit: str, rng: np.random.Generator, sticks: bool = False
) -> tuple[Drives, str]:
    """Drives that fit the links, and the unit that they can be told in.

    A torque constant can only be found where masses that are known ask for a part of the torque; elsewhere the unit
    becomes N m, in which nothing has to be found.
    """
    smallest = np.where(slides, SMALLEST_ROTOR["slides"], SMALLEST_ROTOR["turns"])
    inertia = np.maximum(link_inertia * np.exp(rng.uniform(np.log(0.3), np.log(3.0), len(slides))), smallest)
    frictionless = load.torque + inertia * load.a
    peak, speed = np.abs(frictionless).max(axis=0), np.abs(load.v).max(axis=0)
    coulomb = rng.uniform(*(DRY_STICKING if sticks else DRY), len(peak)) * peak
    viscous = rng.uniform(0.03, 0.08, len(peak)) * peak / speed
    told = np.std(load.torque, axis=0) / np.std(frictionless, axis=0)
    if unit != "Nm" and told.min() < TELLING:
        unit = "Nm"
    k = np.ones(len(peak)) if unit == "Nm" else 1.1 * peak / rng.uniform(*LARGEST[unit], len(peak))
    return Drives(inertia, coulomb, viscous, k, sticks), unit
