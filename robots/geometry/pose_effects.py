# SPDX-License-Identifier: BSD-3-Clause
"""Effects that poses can show: which parameters each has, on whom it acts, and its unit.

Stiffnesses that a robot file lacks are effects here (`joint_elasticity`, `bearing_flexibility`): a joint without one is
rigid. The others are zero in an arm without them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from jointscope.robots.geometry.error_parameters import (
    BACKLASH,
    BEARING,
    CUBIC,
    LINK_MASS,
    PAYLOAD,
    RIPPLE,
    STIFFNESS,
    WAVES,
)

DRIFT = tuple(f"tracker.tracker_drift.{axis}" for axis in "xyz")


@dataclass(frozen=True)
class PoseEffectKind:
    """A kind of effect.

    Attributes:
        id: of the catalogue.
        parts: parameters at a joint; empty for an effect of the robot as a whole.
        names: full names of the parameters of the whole robot.
        unit: of all its parameters.
        size: what it may be, 1 sigma, in that unit; of stiffnesses the largest compliance [rad/(N m)].
        soft: whether its parameter is a stiffness, estimated as a compliance where it is looked for.
        needs_spring: whether it acts in a spring that must be there.
        orders: waves per turn that are looked at; the best one counts, as one of so many.
    """

    id: str
    parts: tuple[str, ...]
    unit: str
    size: float
    names: tuple[str, ...] = ()
    soft: bool = False
    needs_spring: bool = False
    orders: tuple[int, ...] = ()

    def parameters(self, owner: str) -> tuple[str, ...]:
        """Full names of its parameters."""
        return self.names or tuple(f"{owner}.{part}" for part in self.parts)


KINDS = (
    PoseEffectKind("encoder_eccentricity", WAVES, "rad", 1e-3),
    PoseEffectKind("gear_ripple", RIPPLE[:2], "rad", 1e-3, orders=tuple(range(2, 201))),
    PoseEffectKind("joint_elasticity", (STIFFNESS,), "N m/rad", 1e-4, soft=True),
    PoseEffectKind("bearing_flexibility", BEARING, "N m/rad", 3e-5, soft=True),
    PoseEffectKind("backlash", (BACKLASH,), "rad", 5e-4),
    PoseEffectKind("spring_cubic", (CUBIC,), "N m/rad^3", 1e11, needs_spring=True),
    PoseEffectKind("payload", (), "kg", 3.0, (PAYLOAD,), needs_spring=True),
    PoseEffectKind("link_mass", (LINK_MASS,), "kg", 3.0, needs_spring=True),
    PoseEffectKind("tracker_drift", (), "m", 1e-3, DRIFT),
)


@dataclass(frozen=True)
class PoseHypothesis:
    """An effect at its owner, as ID@OWNER, and its waves per turn where it has any."""

    kind: PoseEffectKind
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


def hypotheses(joints: Sequence[str], known: Mapping[str, object], tracked: bool) -> list[PoseHypothesis]:
    """Effects that a model lacks.

    Args:
        joints: of the chain, base to tip.
        known: names of the parameters that it has.
        tracked: whether a tracker measures; contacts do not drift.
    """
    springs = [i for i, joint in enumerate(joints) if f"{joint}.{STIFFNESS}" in known]
    soft = springs + [i for i, j in enumerate(joints) if any(f"{j}.{part}" in known for part in BEARING)]
    found = []
    for kind in KINDS:
        if kind.id == "tracker_drift":
            owners: Sequence[str] = ("robot",) if tracked else ()
        elif kind.names:
            owners = ("robot",) if soft else ()
        elif kind.id == "link_mass":
            owners = joints[min(soft) :] if soft else ()
        else:
            owners = [joints[i] for i in springs] if kind.needs_spring else joints
        found += [PoseHypothesis(kind, owner) for owner in owners]
    return [h for h in found if not any(name in known for name in h.names)]


def effect_units(joints: Sequence[str]) -> dict[str, str]:
    """Unit of every parameter of every effect, by full name."""
    units = {n: kind.unit for kind in KINDS for joint in joints for n in kind.parameters(joint)}
    return units | {f"{joint}.{RIPPLE[2]}": "1" for joint in joints}
