# SPDX-License-Identifier: BSD-3-Clause
"""Effects of an arm that poses or frequency responses can show: parameters, owners, units, and where they do nothing.

Stiffnesses that a robot file lacks are effects here (`joint_elasticity`, `bearing_flexibility`): a joint without one is
rigid. The others are zero in an arm without them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from jointscope.robots.geometry.error_parameters import (
    BACKLASH,
    BEARING,
    CUBIC,
    HALF_GAP,
    LINK_INERTIA,
    LINK_MASS,
    LOAD_FRICTION,
    PAYLOAD,
    RIPPLE,
    STIFFNESS,
    STRIBECK,
    TORQUE_DELAY,
    TORQUE_SHARE,
    WAVES,
)

POSES, FREQUENCY = "poses", "frequency"
DRIFT = tuple(f"tracker.tracker_drift.{axis}" for axis in "xyz")
NO_TORQUE = {POSES: "angles and the target tell poses, not torques"}
NO_MOTION = {POSES: "nothing moves at rest"}


@dataclass(frozen=True)
class ArmEffectKind:
    """A kind of effect.

    Attributes:
        id: of the catalogue.
        parts: parameters at a joint; empty for an effect of the robot as a whole.
        names: full names of the parameters of the whole robot.
        unit: of all its parameters.
        size: what it may be, 1 sigma, in that unit; of stiffnesses the largest compliance [rad/(N m)].
        soft: whether its parameter is a stiffness, estimated as a compliance where it is looked for.
        needs_spring: whether it acts in a spring that must be there.
        of_motor: whether it acts on a motor that must be shaken.
        orders: waves per turn that are looked at; the best one counts, as one of so many.
        unseen: kinds of recordings in which it does nothing that counts, and why.
        catalogue: what motion calls its one parameter at a joint where that has another name and sign, and the factor.
    """

    id: str
    parts: tuple[str, ...]
    unit: str
    size: float
    names: tuple[str, ...] = ()
    soft: bool = False
    needs_spring: bool = False
    of_motor: bool = False
    orders: tuple[int, ...] = ()
    unseen: Mapping[str, str] = field(default_factory=dict)
    catalogue: tuple[str, float] = ("", 1.0)

    def parameters(self, owner: str) -> tuple[str, ...]:
        """Full names of its parameters."""
        return self.names or tuple(f"{owner}.{part}" for part in self.parts)


KINDS = (
    ArmEffectKind("encoder_eccentricity", WAVES, "rad", 1e-3),
    ArmEffectKind("gear_ripple", RIPPLE[:2], "rad", 1e-3, orders=tuple(range(2, 201))),
    ArmEffectKind("joint_elasticity", (STIFFNESS,), "N m/rad", 1e-4, soft=True),
    ArmEffectKind("bearing_flexibility", BEARING, "N m/rad", 3e-5, soft=True),
    ArmEffectKind(
        "backlash",
        (BACKLASH,),
        "rad",
        5e-4,
        unseen={FREQUENCY: "a drive that rattles in its gap answers otherwise at every size of the excitation"},
        catalogue=(HALF_GAP, -1.0),
    ),
    ArmEffectKind("spring_cubic", (CUBIC,), "N m/rad^3", 1e11, needs_spring=True),
    ArmEffectKind("payload", (), "kg", 3.0, (PAYLOAD,), needs_spring=True),
    ArmEffectKind("link_mass", (LINK_MASS,), "kg", 3.0, needs_spring=True),
    ArmEffectKind("inertia_error", (LINK_INERTIA,), "kg m2", 1.0, unseen=NO_MOTION),
    ArmEffectKind("torque_constant_error", (TORQUE_SHARE,), "1", 0.2, of_motor=True, unseen=NO_TORQUE),
    ArmEffectKind("torque_delay", (), "s", 5e-3, (TORQUE_DELAY,), unseen=NO_MOTION),
    ArmEffectKind("motor_stribeck", (STRIBECK,), "N m", 10.0, of_motor=True, unseen=NO_MOTION),
    ArmEffectKind("load_dependent_friction", (LOAD_FRICTION,), "1", 0.1, of_motor=True, unseen=NO_MOTION),
    ArmEffectKind(
        "tracker_drift", (), "m", 1e-3, DRIFT, unseen={FREQUENCY: "no target is measured while the arm is shaken"}
    ),
)


@dataclass(frozen=True)
class ArmHypothesis:
    """An effect at its owner, as ID@OWNER, and its waves per turn where it has any."""

    kind: ArmEffectKind
    owner: str
    order: int | None = None

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return f"{self.kind.id}@{self.owner}"

    @property
    def names(self) -> tuple[str, ...]:
        """Full names of its parameters."""
        return self.kind.parameters(self.owner)

    @property
    def catalogue_names(self) -> tuple[str, ...]:
        """What motion calls them."""
        return (f"{self.owner}.{self.kind.catalogue[0]}",) if self.kind.catalogue[0] else self.names


def hypotheses(
    joints: Sequence[str], known: Collection[str], tracked: bool, shaken: Sequence[str] | None = None
) -> list[ArmHypothesis]:
    """Effects that a model lacks, and that one of the kinds there are shows.

    Args:
        joints: of the chain, base to tip.
        known: names of the parameters that it has.
        tracked: whether a tracker measures; contacts do not drift.
        shaken: joints whose motors are shaken; None without frequency responses.
    """
    springs = [i for i, joint in enumerate(joints) if f"{joint}.{STIFFNESS}" in known]
    soft = springs + [i for i, j in enumerate(joints) if any(f"{j}.{part}" in known for part in BEARING)]
    found = []
    for kind in KINDS:
        if shaken is None and POSES in kind.unseen:
            owners: Sequence[str] = ()
        elif kind.id == "tracker_drift":
            owners = ("robot",) if tracked else ()
        elif kind.names:
            owners = ("robot",) if soft else ()
        elif kind.of_motor:
            owners = tuple(shaken or ())
        elif kind.id in ("link_mass", "inertia_error"):
            owners = joints[min(soft) :] if soft else ()
        else:
            owners = [joints[i] for i in springs] if kind.needs_spring else joints
        found += [ArmHypothesis(kind, owner) for owner in owners]
    return [h for h in found if not any(name in known for name in (*h.names, *h.catalogue_names))]


def effect_units(joints: Sequence[str]) -> dict[str, str]:
    """Unit of every parameter of every effect, by full name."""
    units = {n: kind.unit for kind in KINDS for joint in joints for n in kind.parameters(joint)}
    return units | {f"{joint}.{RIPPLE[2]}": "1" for joint in joints}
