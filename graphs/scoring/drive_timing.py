# SPDX-License-Identifier: BSD-3-Clause
r"""Whether the drive signal and the sensors were stamped at the same time: a score test after every calibration.

A torque that acts a time d after its stamp looks like friction and springs that are not there,

    tau(t - d) = tau(t) - d tau'(t),        tau' holds M a' = -M omega^2 v for a motion with frequency omega,

and process noise takes what is left, so no residual tells. One linear step with a delay does: how long it would be, and
by how much it would change the values. Nothing is estimated anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.score_system import Segment
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

EFFECT, OWNER = "command_delay", "robot"
EARLY_OR_LATE = 5.0  # [sigma] from which a delay of the drive signal is one ...
MOVES = (3.5, 0.01)  # [sigma of a value, share of it], both, from which it matters


@dataclass(frozen=True)
class DriveTiming:
    """What one step with a delay of the drive signal says.

    Attributes:
        delay: of the torque after its stamp; below zero where the signal was late [s].
        sigma: its standard deviation, from blocks of the recording where these scatter more [s].
        changes: what the delay would add to each parameter, in the parameter's unit.
    """

    delay: float
    sigma: float
    changes: dict[str, float]

    @property
    def label(self) -> str:
        """The effect that calibrates it, ID@OWNER."""
        return f"{EFFECT}@{OWNER}"

    def moved(self, found: Mapping[str, Value]) -> list[str]:
        """Names of the values that the delay would change by much; none where it may be chance.

        Args:
            found: calibrated values with their sigmas, by name.
        """
        if abs(self.delay) < EARLY_OR_LATE * self.sigma:
            return []
        (sigmas, share), changes = MOVES, {n: abs(self.changes[n]) for n in found if n in self.changes}
        return [n for n, d in changes.items() if d > sigmas * found[n].sigma and d > share * abs(found[n].value)]


def drive_timing(
    problems: Sequence[BagProblem], states: Sequence[Array], calibrations: Sequence[Calibration]
) -> DriveTiming | None:
    """The delay that a solved calibration asks for; None where the model has times of its own, or no commands.

    Args:
        problems: whole recordings with the noise used.
        states: their solution.
        calibrations: the values found, with the biases of each recording.
    """
    robot = problems[0].robot
    if robot.choices.link_dynamics != "model" or _has_times(robot):
        return None
    effect = catalogue()[EFFECT]
    hypothesis = EffectHypothesis(EffectAt(effect, OWNER), effect.parameters_at(robot, OWNER))
    segments = [Segment.of(*one) for one in zip(problems, states, calibrations, strict=True)]
    (step,) = ScoreTest(segments).steps([hypothesis])
    delay, sigma = float(step.sizes[0]), float(step.sigmas[0])
    if not np.isfinite(delay) or not np.isfinite(sigma):
        return None
    found = calibrations[0]
    moved = found.retract({DYNAMICS: step.response[: len(found.names), 0] * delay})
    changes = dict(zip(found.names, (moved.values - found.values).tolist(), strict=True))
    return DriveTiming(delay, sigma, changes)


def _has_times(robot: Robot) -> bool:
    return any(isinstance(here.effect, CommandEffect | TimeShift) for here in robot.effects)
