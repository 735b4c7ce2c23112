# SPDX-License-Identifier: BSD-3-Clause
"""The waterfall: one step per effect that was added or removed, with the error on training and held-out recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

from jointscope.graphs.comparison.comparison_result import ModelComparison
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


@dataclass(frozen=True)
class SavedStep:
    """A finished step of an earlier run, from which a discovery continues; see DiscoveryStep.

    Attributes:
        added, removed: ID@OWNER, or None; the first step is the base model.
        robot: as it was calibrated then.
        robot_file: where it lies.
        train_error, heldout_error, floor: as they were found then.
        paragraph: what the step means.
    """

    added: str | None
    removed: str | None
    robot: Robot
    robot_file: str
    train_error: float
    heldout_error: float
    floor: float
    paragraph: str = ""


@dataclass(frozen=True)
class DiscoveryStep:
    """One model on the way.

    Attributes:
        added, removed: ID@OWNER, or None; the first step is the base model.
        robot: calibrated with all training recordings.
        train_error: error on the training recordings, on the pieces where a diagnosis validates; this model was fitted
            to all of them, so nothing is left out.
        heldout_error: error on the held-out recording, which never chooses; NaN without one.
        floor: of the held-out recording, else of the first training recording.
        diagnosis: what was found with this model as the base; None for the last step where nothing was diagnosed.
        comparison: prediction against measurement on the held-out recording, else on the first training recording.
        robot_file: where the robot was written; empty if it was not.
        paragraph: what the step means, in plain words.
    """

    added: str | None
    removed: str | None
    robot: Robot
    train_error: float
    heldout_error: float
    floor: float
    diagnosis: Diagnosis | None
    comparison: ModelComparison
    robot_file: str = ""
    paragraph: str = ""

    @property
    def label(self) -> str:
        """What changed."""
        if self.added is None and self.removed is None:
            return "base model"
        parts = ([f"+ {self.added}"] if self.added else []) + ([f"- {self.removed}"] if self.removed else [])
        return " ".join(parts)


def with_lasting_floors(steps: Sequence[DiscoveryStep]) -> tuple[DiscoveryStep, ...]:
    """Steps with the lowest floor that they or later ones found.

    What noise alone would give is the same for all models of a recording. Noise that was estimated while something was
    missing holds part of that, and may lie above the error itself; a better model knows it better.
    """
    found, lowest = [], float("inf")
    for step in reversed(steps):
        lowest = min(lowest, step.floor) if isfinite(step.floor) else lowest
        found.append(replace(step, floor=lowest if isfinite(lowest) else step.floor))
    return tuple(reversed(found))


@dataclass(frozen=True)
class Discovery:
    """All steps of a discovery.

    Attributes:
        steps: the base model first.
        stop_reason: why it ended, one sentence.
        adequate: whether the last model is adequate.
        robot_file: where the last robot was written; empty if it was not.
        held_out: whether there was a held-out recording.
        recordings: for training.
        heldout: the held-out recording, if there was one.
    """

    steps: tuple[DiscoveryStep, ...]
    stop_reason: str
    adequate: bool
    robot_file: str = ""
    held_out: bool = True
    recordings: tuple[Recording, ...] = field(default=(), repr=False)
    heldout: Recording | None = field(default=None, repr=False)

    @property
    def judged_by(self) -> str:
        """Whose errors the steps tell, as of `ModelComparison`."""
        return self.steps[0].comparison.judged_by

    @property
    def robot(self) -> Robot:
        """The last model."""
        return self.steps[-1].robot

    def to_json(self) -> dict[str, Any]:
        """The JSON of the verb `discover`."""
        return {
            "steps": [
                {
                    "added": step.added,
                    "removed": step.removed,
                    "train_error": step.train_error,
                    "heldout_error": step.heldout_error if self.held_out else None,
                    "floor": step.floor,
                    "robot_file": step.robot_file or None,
                    "paragraph": step.paragraph,
                }
                for step in self.steps
            ],
            "stop_reason": self.stop_reason,
            "adequate": self.adequate,
            "robot_file": self.robot_file or None,
        }
