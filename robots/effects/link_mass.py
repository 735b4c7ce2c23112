# SPDX-License-Identifier: BSD-3-Clause
"""A link that is heavier, or balanced elsewhere, than the URDF says."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect, about_origin

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]
MOMENTS = ("x", "y", "z")
LARGEST = 5.0  # times the mass that the URDF has


def change(body: Array) -> dict[str, Array]:
    """More of the body's own material where it is, and first moments alone.

    Args:
        body: its ten dynamic parameters, shape (10,).

    Returns:
        Change of these by mass [kg] and by each first moment [kg m], shape (10,) each.
    """
    more = body / body[0] if body[0] > 0.0 else np.eye(10)[0]
    return {"mass": more, **{axis: np.eye(10)[1 + i] for i, axis in enumerate(MOMENTS)}}


@dataclass(frozen=True, kw_only=True)
class LinkMass(InertiaEffect):
    """Sizes on the scale of the link's own mass and length."""

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """With priors of a few times what the URDF has."""
        body = robot.tree.model.inertias[robot.tree.model.getJointId(owner)].toDynamicParameters()
        if body[0] <= 0.0:
            return self.parameters
        mass = LARGEST * float(body[0])
        length = float(np.sqrt(np.trace(about_origin(body)) / (2.0 * body[0])))  # root of the mean squared distance
        sigmas = (mass, *(mass * max(length, 1e-3),) * len(MOMENTS))
        return tuple(replace(p, prior_sigma=sigma) for p, sigma in zip(self.parameters, sigmas, strict=True))


EFFECT = LinkMass(
    id="link_mass",
    change=change,
    parameters=(
        EffectParameter("mass", "kg", start=0.0, prior_sigma=10.0, weak=True),
        *(EffectParameter(axis, "kg m", start=0.0, prior_sigma=1.0, weak=True) for axis in MOMENTS),
    ),
    example={"mass": 0.5, "x": 0.02, "y": 0.02, "z": 0.02},
    card=Card(
        title="wrong mass of a link",
        law="(m, m c, I) = (m, m c, I)_model (1 + mass / m_model) + (0, (x, y, z), 0) in the frame of the link's joint",
        explanation="The link weighs more or less than in the URDF, or its centre of mass is elsewhere: motors, cables "
        "and covers are missing there, or a density was guessed. Combinations that no motion shows stay at zero, held "
        "by their prior.",
        source="Atkeson, An, Hollerbach (1986), Estimation of inertial parameters of manipulator loads and links, "
        "International Journal of Robotics Research 5(3); Gautier, Khalil (1990), Direct calculation of minimum set of "
        "inertial parameters of serial robots, IEEE Transactions on Robotics and Automation 6(3), on combinations",
        typical="5 to 40 % of a mass from a drawing",
        excitation="slow motion in several postures, and accelerations of all joints before the link",
        look_alikes={
            "load_scale": "a load that is always the same is a mass of the link that it hangs on",
            "torque_constant_error": "a drive that makes less torque is as one that moves heavier links",
            "payload": "a load at the tool that is always there is a mass of the link that carries it",
            "inertia_error": "where little gravity acts, a heavier link is one with more inertia",
            "gravity_imbalance": "at one joint a wrong first moment is a weight that turns with the angle",
            "axis_misalignment": "a first moment of a link is one whose centre of mass stands askew",
        },
    ),
)
