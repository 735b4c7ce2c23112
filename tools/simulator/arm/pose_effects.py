# SPDX-License-Identifier: BSD-3-Clause
"""What may be wrong with an arm at rest beside its geometry, in the simulator's own form."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_catalogue import without_alias
from jointscope.tools.simulator.effects import parameters_in

DEFAULTS: Mapping[str, Mapping[str, float]] = {
    "backlash": {"half_gap": 2.0e-4},  # [rad]
    "encoder_eccentricity": {"cos": 1.0e-4, "sin": 6.0e-5},  # [rad] once per turn
    "gear_ripple": {"amplitude": 8.0e-5, "order": 100.0, "phase": 0.3},  # [rad], [1/turn], [rad]
    "spring_cubic": {"stiffness": 2.0e10},  # [N m/rad^3] beside the linear spring
    "joint_elasticity": {"compliance": 4.0e-5},  # [rad/(N m)] of a joint without a stiffness in the robot file
    "bearing_flexibility": {"compliance_x": 5.0e-6, "compliance_y": 5.0e-6},  # [rad/(N m)] beside the robot file's
    "payload": {"mass": 2.0},  # [kg] at the target
    "link_mass": {"mass": 2.0},  # [kg] more of the link's own material than in the URDF
    "torque_constant_error": {"share": 0.05},  # motors make that much more torque than they say
    "motor_stribeck": {"torque": 6.0, "velocity": 0.02},  # [N m], [rad/s] dry friction's breakaway; nothing at rest
    "load_dependent_friction": {"coefficient": 0.03},  # of what the drive passes on, as dry friction; nothing at rest
    "torque_delay": {"seconds": 1.0e-3},  # [s] by which the torques of all motors are late; nothing at rest
    "tracker_drift": {"x": 1.0e-4, "y": 0.0, "z": 5.0e-5},  # [m] from the first pose to the last
}
OF_ROBOT = ("payload", "torque_delay", "tracker_drift")


@dataclass(frozen=True)
class PoseEffect:
    """One effect: id, owner (a joint, or "robot") and its sizes."""

    id: str
    owner: str
    parameters: Mapping[str, float]

    @property
    def truth(self) -> dict[str, Any]:
        """As the truth beside a recording names it, fit for JSON."""
        return {"effect": self.id, "owner": self.owner, "parameters": dict(self.parameters)}


def pose_effects(texts: Iterable[str], joints: Sequence[str]) -> list[PoseEffect]:
    """Effects from texts ID@OWNER[:param=value,...].

    Raises:
        EffectError: unknown id, owner or parameter, or a value that is no number.
    """
    found = []
    for text in texts:
        head, _, tail = text.partition(":")
        effect, _, owner = without_alias(head).partition("@")
        if effect not in DEFAULTS:
            raise EffectError(f"effect {effect!r} cannot be simulated in poses; known are {', '.join(DEFAULTS)}")
        owners = ("robot",) if effect in OF_ROBOT else tuple(joints)
        if owner not in owners:
            raise EffectError(f"effect {effect} cannot act on {owner!r}; it acts on {', '.join(owners)}")
        found.append(PoseEffect(effect, owner, {**DEFAULTS[effect], **_sizes(text, effect, tail)}))
    return found


def _sizes(text: str, effect: str, tail: str) -> dict[str, float]:
    sizes = parameters_in(text, tail)
    unknown = next((name for name in sizes if name not in DEFAULTS[effect]), None)
    if unknown is not None:
        raise EffectError(f"effect {effect} has no parameter {unknown!r}; it has {', '.join(DEFAULTS[effect])}")
    return sizes
