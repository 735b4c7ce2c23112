# SPDX-License-Identifier: BSD-3-Clause
"""Models with one more effect, calibrated with all kinds as cheaply as the question allows.

Most effects are refused, so a trial need not be a model for good. Where an effect does nothing in the motion, that is
the Gaussian factor that it was at the last model; what is believed is then calibrated in full. Where it does, all
samples are asked, from the states of the last model on, and for their noise, too: beside one that a fit of the motion
alone has found, kinds that contradict each other would have another say.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from jointscope.graphs.across_kinds.beside_still_motion import calibrate_trial, does_nothing_in_motion
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.across_kinds.shared_model import SharedModel, calibrate_shared
from jointscope.graphs.joint_kinds.motion_summary import MotionSummary
from jointscope.graphs.solving.batch_solver import Progress, Solver, solve
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot


@dataclass(frozen=True)
class Trial:
    """A model with one more effect.

    Attributes:
        model: calibrated.
        beside: the model without the effect, calibrated in the same way.
    """

    model: SharedModel
    beside: SharedModel


@dataclass(frozen=True)
class Trials:
    """All trials beside one model.

    Attributes:
        given: recordings of all kinds.
        base: the model.
        report: called with a text and the share done.
        solver: minimises the cost of all samples.
    """

    given: KindsRecordings
    base: SharedModel
    report: Progress
    solver: Solver = solve

    def of(self, grown: Robot) -> Trial:
        """The model with an effect that has some sizes.

        Args:
            grown: the robot with the effect.

        Raises:
            JointscopeError: as of `calibrate_shared`.
        """
        if self.base.motion is not None and does_nothing_in_motion(grown, self.base.robot):
            found = calibrate_trial(grown, self.given, self.base, self._motion, self.report)
            if found is not None:
                return Trial(found, self._without)
        return Trial(self._calibrated(grown, self.base), self.base)

    def settled(self, trial: Trial) -> Trial:
        """The model of a trial, calibrated in full.

        Raises:
            JointscopeError: as of `calibrate_shared`.
        """
        if trial.model.settled:
            return trial
        return Trial(self._calibrated(trial.model.robot, trial.model), self.base)

    def smaller(self, robot: Robot) -> SharedModel:
        """The model without one of its effects.

        Raises:
            JointscopeError: as of `calibrate_shared`.
        """
        return self._calibrated(robot, self.base)

    def _calibrated(self, robot: Robot, near: SharedModel) -> SharedModel:
        return calibrate_shared(robot, self.given, near.motion, self.report, self.solver)

    @cached_property
    def _motion(self) -> MotionSummary:
        assert self.base.motion is not None
        return MotionSummary.of(self.base.motion.result)

    @cached_property
    def _without(self) -> SharedModel:
        """The base where friction is where it is likeliest, as trials have it; of other kinds that is the base."""
        if not self.given.rests:
            return self.base
        found = calibrate_trial(self.base.robot, self.given, self.base, self._motion, self.report)
        if found is None:
            raise SolveError("values of all kinds do not stay where they were found")
        return found
