# SPDX-License-Identifier: BSD-3-Clause
"""Moments of inertia that differ from the model's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect

Array = NDArray[np.float64]
PLACES = {"ixx": 4, "iyy": 6, "izz": 9}  # among the ten dynamic parameters


def change(body: Array) -> dict[str, Array]:
    """One moment of inertia each.

    Args:
        body: its ten dynamic parameters, shape (10,); they do not matter here.

    Returns:
        Change of the ten dynamic parameters by each moment, shape (10,).
    """
    return {name: np.eye(10)[place] for name, place in PLACES.items()}


EFFECT = InertiaEffect(
    id="inertia_error",
    turning=True,
    change=change,
    parameters=tuple(EffectParameter(name, "kg m2", start=0.0, prior_sigma=10.0) for name in PLACES),
    example={"ixx": 0.03, "iyy": 0.04, "izz": 0.02},
    card=Card(
        title="wrong moments of inertia",
        law="I = I_model + diag(ixx, iyy, izz) about the axes of the body's joint frame",
        explanation="Moments of inertia come from a CAD model that lacks cables, screws and glue, or the true density. "
        "Some combinations of different bodies move nothing and stay open: they are reported by name.",
        source="Wu, Wang, You (2010), An overview of dynamic parameter identification of robots, Robotics and "
        "Computer-Integrated Manufacturing 26(5); Schuethe et al. (2016), eq. (10), takes them as known from CAD",
        typical="2 to 20 % of the model's value",
        excitation="acceleration of the joint and of all joints before it, in several postures",
        look_alikes={
            "encoder_filter": "in motion of one frequency a smaller amplitude is a larger inertia",
            "payload": "a payload is one combination of errors of the last body's moments of inertia",
            "bearing_flexibility": "its transverse inertias are moments of the same body",
            "gravity_imbalance": "where gravity acts, a wrong first moment comes with a wrong inertia",
            "kinematic_coupling": "a wrong product of inertia couples the joints, too, but with the acceleration",
            "coriolis": "a wrong inertia matters most in the same fast motion",
            "link_mass": "where little gravity acts, a heavier link is one with more inertia",
            "axis_misalignment": "a body that stands askew has other moments about the axes before it",
        },
    ),
)
