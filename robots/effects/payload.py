# SPDX-License-Identifier: BSD-3-Clause
"""Something at the tip that the model does not know."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect, about_origin

Array = NDArray[np.float64]


def change(body: Array) -> dict[str, Array]:
    """A point mass on the long axis n: m l^2 (1 - n n^T), per m l^2.

    Args:
        body: its ten dynamic parameters, shape (10,).

    Returns:
        Change of the ten dynamic parameters, shape (10,).
    """
    n = np.linalg.eigh(about_origin(body))[1][:, 0]
    xx, xy, xz, yy, yz, zz = (np.eye(3) - np.outer(n, n))[np.triu_indices(3)]
    return {"inertia": np.array([0.0, 0.0, 0.0, 0.0, xx, xy, yy, xz, yz, zz])}


EFFECT = InertiaEffect(
    id="payload",
    turning=True,
    change=change,
    last_only=True,
    parameters=(EffectParameter("inertia", "kg m2", start=0.01, prior_sigma=10.0, sign="+"),),
    example={"inertia": 0.05},
    card=Card(
        title="unknown load at the tip",
        law="I = I_model + J (1 - n n^T), with J = inertia = m l^2 of a point mass on the long axis n of the last "
        "body, the axis of its least inertia",
        explanation="A tool, a camera or a costume at the end of the last body adds inertia about both axes across. "
        "Its weight is not part of it: where gravity acts, gravity_imbalance finds that.",
        source="Swevers, Verdonck, De Schutter (2007), Dynamic model identification for industrial robots, IEEE "
        "Control Systems Magazine 27(5)",
        typical="1 to 50 % of the last body's own inertia",
        excitation="acceleration of all joints that move the last body, in several postures",
        look_alikes={
            "inertia_error": "a payload is one combination of errors of the last body's moments of inertia",
        },
    ),
)
