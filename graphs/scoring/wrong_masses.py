# SPDX-License-Identifier: BSD-3-Clause
"""Whether links weigh what the URDF says: a score test after every calibration under gravity.

A load that the URDF lacks is carried by torque constants, inertias and friction that are all wrong by a few percent,
and most of it is gone from the residuals. One linear step with the mass and the first moments of a link tells how much
heavier it would be, and by how much that would change the values. Nothing is estimated anew. It tells that a mass is
wrong, not which: a load further out has moments of inertia that no link of the URDF has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import cannot_be_added

Array = NDArray[np.float64]

EFFECT = "link_mass"
SURE = 3.5  # [sigma]
BY_CHANCE = 1e-4  # p-value of a wrong mass; 7 arms and legs without one had 0.02 to 0.4, four with one below 3e-6
MOVED = 0.02  # relative change of a value that a wrong mass must make


@dataclass(frozen=True)
class WrongMass:
    """What one step with another mass of a link says.

    Attributes:
        joint: that moves the link.
        mass: that is missing in the URDF, with what a shift of the link's centre stands for [kg].
        sigma: its standard deviation, from blocks of the recording where these scatter more [kg].
        p_value: of mass and first moments together, against the scatter of blocks.
        changes: what the mass would add to each parameter, in the parameter's unit.
    """

    joint: str
    mass: float
    sigma: float
    p_value: float
    changes: dict[str, float]

    def moved(self, found: Mapping[str, Value]) -> dict[str, float]:
        """Relative changes of the values that the mass would change by much, by name; none where it may be chance.

        Inertias of rotors are left out: a link and its rotor share theirs, and only the sum is told.

        Args:
            found: calibrated values with their sigmas, by name.
        """
        told = {n: d for n, d in self.changes.items() if n in found and found[n].value and not n.endswith(".inertia")}
        shares = {n: d / abs(found[n].value) for n, d in told.items() if abs(d) > SURE * found[n].sigma}
        return shares if self.p_value <= BY_CHANCE and max(map(abs, shares.values()), default=0.0) >= MOVED else {}


def wrong_masses(test: ScoreTest) -> tuple[WrongMass, ...]:
    """What a solved calibration says of each link's mass, surest first.

    Without gravity, nothing is said.

    Args:
        test: of the whole recordings, linearised at their solution with the noise used.
    """
    robot, effect = test.robot, catalogue()[EFFECT]
    if robot.choices.link_dynamics != "model" or not np.any(robot.tree.gravity):
        return ()
    here = [EffectAt(effect, owner) for owner in effect.owners_of(robot) if not robot.has_effect(EFFECT, owner)]
    hypotheses = [
        EffectHypothesis(at, effect.parameters_at(robot, at.owner)) for at in here if not cannot_be_added(robot, at)
    ]
    start, found = test.calibration.by_name, []
    for step in test.steps(hypotheses):
        if not (np.all(np.isfinite(step.sizes)) and np.all(np.isfinite(step.sigmas))):
            continue
        changes = {name: value - start[name] for name, value in test.values_with(step).items()}
        found.append(
            WrongMass(step.hypothesis.here.owner, float(step.sizes[0]), float(step.sigmas[0]), step.p_value, changes)
        )
    return tuple(sorted(found, key=lambda mass: mass.p_value))
