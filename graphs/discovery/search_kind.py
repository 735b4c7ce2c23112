# SPDX-License-Identifier: BSD-3-Clause
"""What a search for missing effects does with a model, by the kind of recordings; motion is one of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Protocol

from jointscope.graphs.calibration.base_model import BaseModel, with_full_gyros
from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.comparison.comparison_result import ModelComparison
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.side_by_side import SideBySide, solver_of
from jointscope.graphs.discovery.starting_model import starting_model
from jointscope.graphs.discovery.unexplained import believed_floor
from jointscope.graphs.discovery.verdicts import MATTERS
from jointscope.graphs.refits.validation import ValidationError, fit_and_judge, judged_error
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


class Errors(Protocol):
    """How large the error of a model is on its training recordings."""

    @property
    def error(self) -> float:
        """Root mean square [sensor sigma]."""


class Kind(Protocol):
    """What a search does with a model; how, depends on the kind of recordings."""

    @property
    def must_explain(self) -> float:
        """Share of the squared training error that an effect must take away in the end."""

    def calibrated(self, robot: Robot, start: Any = None) -> Any:
        """A model, which has its robot, calibrated with the training recordings; near another one if one is given."""

    def errors(self, model: Any) -> Errors:
        """Errors of a model on the training recordings."""

    def compared(self, label: str, robot: Robot) -> ModelComparison:
        """A model against the held-out recording, else against the first training recording."""

    def floor(self, comparison: ModelComparison) -> float:
        """What noise alone would leave of the error of a model that was compared [sensor sigma], as far as believed."""

    def diagnosed(
        self, model: Any, comparison: ModelComparison, errors: Any, report: Progress, barred: Collection[str] = ()
    ) -> Diagnosis:
        """What a model lacks; `barred`: candidates that did not hold, where others may take their place."""


@dataclass(frozen=True)
class Motion:
    """Recordings of motion (`Kind`); attributes as the arguments of `discover`."""

    recordings: tuple[Recording, ...]
    holdout: Recording | None
    missing_torque: bool
    side_by_side: SideBySide | None
    must_explain: float = MATTERS

    def calibrated(self, robot: Robot, start: BaseModel | None = None) -> BaseModel:
        """All components of every gyro are predicted."""
        solver = solver_of(self.side_by_side)
        if start is None:
            return starting_model(with_full_gyros(robot), self.recordings, solver)
        return BaseModel.of(robot, self.recordings, start, solver=solver)

    def errors(self, model: BaseModel) -> ValidationError:
        """On the pieces where a diagnosis validates."""
        return judged_error(model, model.robot, model.calibrations, fit_and_judge(model)[1])

    def compared(self, label: str, robot: Robot) -> ModelComparison:
        """Predictions from causal states."""
        return compare_model(label, robot, self.holdout or self.recordings[0])

    def floor(self, comparison: ModelComparison) -> float:
        """That of the model's noise, or that of the sensors where the error lies well below it."""
        return believed_floor(comparison, self.holdout or self.recordings[0])

    def diagnosed(
        self, model: BaseModel, comparison: ModelComparison, errors: Any, report: Progress, barred: Collection[str] = ()
    ) -> Diagnosis:
        """The catalogue, scored and refitted."""
        return diagnose(
            model.robot,
            self.recordings,
            self.holdout,
            base=model,
            comparison=comparison,
            validation=errors,
            missing_torque=self.missing_torque,
            side_by_side=self.side_by_side,
            barred=barred,
            each_held_out=False,
            progress=report,
        )
