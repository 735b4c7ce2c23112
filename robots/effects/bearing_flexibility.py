# SPDX-License-Identifier: BSD-3-Clause
"""A soft bearing: the base of a joint tilts about the two axes across its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.model.structured_tree import hidden_inertias, inertia_about_joint
from jointscope.robots.model.turned_axes import across_axes

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

STIFFER = 10.0  # than the joint's own spring
DAMPING_RATIO = 0.05


@dataclass(frozen=True, kw_only=True)
class BearingFlexibility(Structure):
    """Two sprung hinges; natural scales come from the joint's own spring and body."""

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """Joints that move an inertia, which a tilted bearing would shake."""
        return tuple(joint for joint in super().owners_of(robot) if joint not in robot.tree.massless)

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """Starts ten times stiffer than the joint's spring, with the inertia of the model's body.

        All five entries of the inertia that a rigid bearing hides come along; the sixth is that about the joint.
        """
        model = robot.tree.model
        joint = model.getJointId(owner)
        body = inertia_about_joint(model, joint)
        spring = robot.parameters.get(f"{owner}.stiffness")
        start = {name: float(body[entry]) for name, entry in hidden_inertias(model, joint).items()}
        for axis, k in zip("xy", across_axes(model, joint), strict=True):
            compliance = next(p.start for p in self.parameters if p.name == f"compliance_{axis}")
            if spring is not None:
                compliance = 1.0 / (STIFFER * spring.value)
            start[f"compliance_{axis}"] = compliance
            start[f"damping_{axis}"] = 2.0 * DAMPING_RATIO * float(np.sqrt(body[k, k] / compliance))
        return tuple(_at(p, start[p.name]) for p in self.parameters)


def _at(p: EffectParameter, start: float) -> EffectParameter:
    """The parameter with another start and the same relative prior; products of inertia may be zero."""
    grid = (start,) if p.is_shape else ()
    prior_sigma = p.prior_sigma / p.start * start if p.logarithmic else p.prior_sigma
    return replace(p, start=start, prior_sigma=prior_sigma, grid=grid)


def _size(name: str, unit: str, start: float) -> EffectParameter:
    return EffectParameter(name, unit, start, 3.0 * start, sign="+", logarithmic=True)


def _shape(name: str, unit: str, start: float, relative_sigma: float, weak: bool = False) -> EffectParameter:
    """Damping and inertia do not matter while the bearing is rigid, so they have no null value of their own."""
    return EffectParameter(
        name, unit, start, relative_sigma * start, sign="+", logarithmic=True, grid=(start,), weak=weak
    )


def _product(name: str) -> EffectParameter:
    """Zero for a body that is symmetric about the joint; a tenth of a usual moment of inertia is much."""
    return EffectParameter(name, "kg m2", start=0.0, prior_sigma=0.2, grid=(0.0,), weak=True)


EFFECT = BearingFlexibility(
    id="bearing_flexibility",
    turning=True,
    form="bearing",
    parameters=(
        *(_size(f"compliance_{axis}", "rad/(N m)", 1.0 / 3000.0) for axis in "xy"),
        *(_shape(f"damping_{axis}", "N m s/rad", 10.0, 3.0) for axis in "xy"),
        *(_shape(f"inertia_{axis}", "kg m2", 2.0, 0.5, weak=True) for axis in "xy"),
        *(_product(f"product_{axes}") for axes in ("xy", "xz", "yz")),
    ),
    example={
        **{"compliance_x": 1.0 / 2500.0, "compliance_y": 1.0 / 3200.0},
        **{"damping_x": 12.0, "damping_y": 14.0, "inertia_x": 2.4, "inertia_y": 2.7},
        **{"product_xy": 0.01, "product_xz": -0.015, "product_yz": 0.006},
    },
    card=Card(
        title="soft bearing",
        law="two hinges before the joint, about the axes x, y of its frame across its own: their torques are "
        "-angle / compliance - damping rate; at compliance 0 they are rigid",
        explanation="The bearing or the stand gives way, so that the whole body tilts when other joints accelerate. "
        "Gyros on the body then see rates about axes about which nothing should turn. The inertia of the body about "
        "these axes and its products of inertia, which a rigid bearing hides, come along as weak parameters.",
        source="Schuethe, Wenk, Frese (2016), sec. 3.2 (not modelled), fig. 4, and sec. 6, which proposes the two "
        "hinges; Neubauer et al. (2015), eq. (1), (4) and table 1: bearings as soft as drives",
        typical="1 to 10 times as stiff as the drives; resonance at 3 to 30 Hz",
        excitation="hard reversals of the joints after it while a gyro is on its body",
        look_alikes={
            "joint_elasticity": "both let the body oscillate after a stop; the bearing turns it about other axes",
            "inertia_error": "the transverse inertias are moments of the same body",
            "kinematic_coupling": "a soft bearing lets other joints move the owner's body",
            "gyro_scale": "a small part of the tilt turns with the body's own rate",
            "gyro_delay": "far below a resonance, tilting shifts the rate in phase",
        },
    ),
)
