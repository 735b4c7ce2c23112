# SPDX-License-Identifier: BSD-3-Clause
"""What rests say of a model that was calibrated, from them alone or with motion beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from jointscope.graphs.rest_sets.rest_errors import RestErrors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.doubts import Doubt
from jointscope.graphs.rests.unnoticed import Unnoticed
from jointscope.robots.model.command_words import bag_arguments
from jointscope.robots.model.robot import Robot

if TYPE_CHECKING:
    from jointscope.graphs.calibration.calibration_result import ParameterEstimate


@dataclass(frozen=True)
class SeenRests:
    """Rests of a calibrated robot.

    Attributes:
        robot: with the values that were found and their sigmas.
        start: before.
        problems: the rests of each recording, with their weights.
        parameters: that were found.
        errors: of each recording.
        doubts: what would make the rests far likelier.
        unnoticed: how wrong masses and loads may be before they contradict; empty beside
            motion, which tells of masses itself.
    """

    robot: Robot
    start: Robot
    problems: Sequence[RestSet]
    parameters: Sequence[ParameterEstimate]
    errors: RestErrors
    doubts: tuple[Doubt, ...]
    unnoticed: tuple[Unnoticed, ...]

    @property
    def stood(self) -> tuple[str, ...]:
        """Joints whose motor never moved before a rest."""
        told = np.any(np.vstack([p.rests.moved | (p.rests.creep != 0.0) for p in self.problems]), axis=0)
        return tuple(joint for joint, moved in zip(self.robot.joints, told, strict=True) if not moved)

    @property
    def option(self) -> str:
        """What a user types to name their recordings."""
        return f"--rests {bag_arguments(problem.rests.path for problem in self.problems)}"

    @property
    def count(self) -> int:
        """Number of rests."""
        return sum(len(problem.rests) for problem in self.problems)
