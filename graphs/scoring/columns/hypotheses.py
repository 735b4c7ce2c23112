# SPDX-License-Identifier: BSD-3-Clause
"""What a diagnosis tries: every effect at every owner that the model lacks, its shapes on a grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from jointscope.robots.effect_kinds.effect import EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import cannot_be_added
from jointscope.robots.model.robot import Robot

BEARING_FREQUENCIES = (4.0, 6.0, 9.0, 14.0, 22.0)  # [Hz] resonance of a body on its soft bearing
BEARING_DAMPING_RATIOS = (0.15,)

Range = Mapping[str, float]  # largest deflections of a spring, "forward" and "backward" [rad]

# how much of a better integrator's correction the data want: 0 none, 1 all of it
WHOLE_DEFECT = EffectParameter("share", "1", start=1.0, prior_sigma=10.0, sign="+")


@dataclass(frozen=True)
class EffectHypothesis:
    """One effect at one owner with given shapes.

    Attributes:
        here: the effect.
        sizes: its parameters with a null value; they get one regressor each.
        shapes: values of the shapes, by name; a bearing has "frequency" [Hz] and "damping_ratio" instead.
    """

    here: EffectAt
    sizes: tuple[EffectParameter, ...]
    shapes: Mapping[str, float] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return self.here.label


def hypotheses_of(
    robot: Robot,
    scanned_orders: Mapping[str, Sequence[float]] | None = None,
    at_rest: bool = False,
    deflections: Mapping[str, Range] | None = None,
) -> list[EffectHypothesis]:
    """All hypotheses that make sense for a robot.

    Args:
        robot: the model.
        scanned_orders: orders (periods per turn) at which a spectrum of the missing torque has its peaks, by joint;
            they take the place of the grid of effects that repeat with the position.
        at_rest: whether known loads are part of what was recorded.
        deflections: how far the spring of each joint was seen to be deflected; knots of its laws are placed there.
    """
    found = []
    for effect in catalogue().values():
        for owner in effect.owners_of(robot):
            here = EffectAt(effect, owner)
            if robot.has_effect(effect.id, owner) or cannot_be_added(robot, here):
                continue
            if isinstance(effect, Structure) and effect.form == "loads" and not at_rest:
                continue
            if isinstance(effect, Structure) and effect.form == "integration":
                found.append(EffectHypothesis(here, (WHOLE_DEFECT,)))
                continue
            parameters = effect.parameters_at(robot, owner)
            sizes = tuple(p for p in parameters if not p.is_shape)
            for shapes in _grid(here, parameters, scanned_orders or {}, (deflections or {}).get(owner, {})):
                found.append(EffectHypothesis(here, sizes, shapes))
    return found


def _grid(
    here: EffectAt,
    parameters: Sequence[EffectParameter],
    scanned_orders: Mapping[str, Sequence[float]],
    seen: Range,
) -> list[dict[str, float]]:
    """Combinations of shapes."""
    if isinstance(here.effect, Structure) and here.effect.form == "bearing":
        pairs = product(BEARING_FREQUENCIES, BEARING_DAMPING_RATIOS)
        return [{"frequency": frequency, "damping_ratio": ratio} for frequency, ratio in pairs]
    if isinstance(here.effect, Structure):
        return [{}]
    shapes = [p for p in parameters if p.is_shape]
    grids = [
        tuple(scanned_orders[here.owner])
        if here.effect.id == "cogging" and p.name == "order" and here.owner in scanned_orders
        else tuple(share * seen.get(p.of_range, p.start) for share in p.grid)
        if p.of_range
        else p.grid
        for p in shapes
    ]
    return [dict(zip([p.name for p in shapes], values, strict=True)) for values in product(*grids)]
