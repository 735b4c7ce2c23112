# SPDX-License-Identifier: BSD-3-Clause
"""Adds effects one by one to a robot with free links, as long as seconds that were not fitted are explained better."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from jointscope.graphs.calibration.failures_with_notices import names_notices
from jointscope.graphs.comparison.comparison_result import ModelComparison
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discover import Save, search
from jointscope.graphs.discovery.discovery_result import Discovery, SavedStep
from jointscope.graphs.discovery.search_kind import Errors
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.transmission.compare_links import compare_links_model
from jointscope.graphs.transmission.diagnose_links import diagnose_links
from jointscope.graphs.transmission.links_model import LinksModel
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

MAX_STEPS = 12


@dataclass(frozen=True)
class Links:
    """Recordings of a robot with free links (`Kind`).

    Attributes:
        recordings: for training.
        holdout: chooses nothing.
        must_explain: nothing more; one joint of many matters, and left-out seconds have decided.
    """

    recordings: tuple[Recording, ...]
    holdout: Recording | None
    must_explain: float = 0.0

    def calibrated(self, robot: Robot, start: LinksModel | None = None) -> LinksModel:
        """From the values of the robot, wherever it comes from."""
        return LinksModel.of(robot, self.recordings)

    def errors(self, model: LinksModel) -> Errors:
        """Of the calibration."""
        return model

    def compared(self, label: str, robot: Robot) -> ModelComparison:
        """Each sensor predicted from the others."""
        return compare_links_model(label, robot, self.holdout or self.recordings[0])

    def floor(self, comparison: ModelComparison) -> float:
        """What the noise of the sensors leaves."""
        return comparison.judged_floor

    def diagnosed(
        self,
        model: LinksModel,
        comparison: ModelComparison,
        errors: Errors | None,
        report: Progress,
        barred: Collection[str] = (),
    ) -> Diagnosis:
        """Effects that show without masses; predictions judge them, so `barred` changes nothing."""
        return diagnose_links(
            model.robot, self.recordings, self.holdout, base=model, comparison=comparison, progress=report
        )


@in_solver_context
@names_notices
def discover_links(
    robot: Robot,
    recordings: Sequence[Recording],
    holdout: Recording | None = None,
    *,
    save: Save | None = None,
    resume: Sequence[SavedStep] | None = None,
    max_steps: int = MAX_STEPS,
    progress: Progress | None = None,
) -> Discovery:
    """Finds what motors, links and gyros show of each other; arguments, result and errors as of `discover`."""
    kind = Links(tuple(recordings), holdout)
    return search(kind, robot, holdout is not None, save, resume or (), max_steps, progress)
