# SPDX-License-Identifier: BSD-3-Clause
"""What a diagnosis found: candidates in the order of their evidence, and whether the model is adequate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.comparison_result import AHEAD, ModelComparison
from jointscope.graphs.comparison.failure_analysis import FailureAnalysis
from jointscope.graphs.discovery.missing_torque import MissingTorque
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

VERDICTS = ("missing", "possible", "absent", "untestable", "stand_in")


@dataclass(frozen=True)
class EffectEstimate:
    """One parameter of a candidate: value and standard deviation in `unit`, refitted where `Candidate.refitted`."""

    value: float
    sigma: float
    unit: str


@dataclass(frozen=True)
class Candidate:
    """One effect at one owner, and what the recordings say about it.

    Attributes:
        effect: id of the effect.
        owner: joint, gyro or "robot".
        score: s' S^-1 s at the null value, on a chi-square scale with `dof` degrees of freedom.
        dof: number of parameters with a null value.
        p_value: block-robust, one-sided where the sign is known, corrected for the number of candidates.
        share: part of the excess squared error on validation blocks that the refit removes; NaN without a refit.
        parameters: by the last part of their name.
        refitted: whether the parameters come from a calibration, not from one linear step.
        validation_error: error on validation blocks of the training recordings after the refit; NaN without one.
        heldout_error: error on the held-out recording after the refit; NaN without one.
        bic: change of the Bayesian information criterion, negative where the effect pays; NaN without a refit.
        look_alikes: ID@OWNER of at most three candidates whose regressors correlate above 0.95 in these recordings.
        verdict: one of VERDICTS.
        reasons: why, in plain words, one sentence each.
        numerics: whether it is a defect of the computation.
    """

    effect: str
    owner: str
    score: float
    dof: int
    p_value: float
    parameters: Mapping[str, EffectEstimate]
    verdict: str
    share: float = float("nan")
    refitted: bool = False
    validation_error: float = float("nan")
    heldout_error: float = float("nan")
    bic: float = float("nan")
    look_alikes: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    numerics: bool = False

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return f"{self.effect}@{self.owner}"


@dataclass(frozen=True)
class Diagnosis:
    """Everything that a diagnosis found.

    Attributes:
        robot: the base model, calibrated with the training recordings.
        candidates: best first.
        adequate: whether no physical effect is missing and less than 5 % of the squared error is unexplained.
        unexplained_share: (error^2 - floor^2) / error^2 of the best accepted model, on the held-out recording if there
            is one, else on validation blocks; of the base model where nothing was accepted.
        error, floor: of the base model there.
        validation_error: of the base model on validation blocks.
        failure: where the base model fails.
        missing: torque that the base model lacks, estimated as a free Gauss-Markov torque; None if not estimated.
        noise_levels: for each factor on the calibrated process noise, the labels of the five best candidates.
        placebo_score: largest score per degree of freedom of regressors that mean nothing.
        paragraphs: findings in plain words, most important first.
        refits: robots of the leaders after their refit, by label.
        comparison: of the base model with the held-out recording, else with the first training recording.
        wall_seconds: by stage.
        recordings: for training.
        heldout: the held-out recording, if there was one.
        missing_torque: of each joint on blocks left out, root mean square [N m]; None where predictions are judged.
        missing_torque_percent: the same in percent of the drive's.
        small: what is there, but not worth a parameter, with its torque; largest first.
    """

    robot: Robot
    candidates: tuple[Candidate, ...]
    adequate: bool
    unexplained_share: float
    error: float
    floor: float
    validation_error: float
    failure: FailureAnalysis
    missing: MissingTorque | None
    noise_levels: Mapping[float, tuple[str, ...]]
    placebo_score: float
    paragraphs: tuple[str, ...]
    refits: Mapping[str, Robot] = field(default_factory=dict, repr=False)
    comparison: ModelComparison | None = None
    wall_seconds: Mapping[str, float] = field(default_factory=dict)
    recordings: tuple[Recording, ...] = field(default=(), repr=False)
    heldout: Recording | None = field(default=None, repr=False)
    missing_torque: Mapping[str, float] | None = None
    missing_torque_percent: Mapping[str, float] | None = None
    small: tuple[str, ...] = ()

    @property
    def judged_by(self) -> str:
        """Whose error `error` is, as of `ModelComparison`."""
        return self.comparison.judged_by if self.comparison is not None else AHEAD

    def to_json(self) -> dict[str, Any]:
        """The JSON of the verb `diagnose`."""
        return {
            "adequate": self.adequate,
            "unexplained_share": self.unexplained_share,
            "error": self.error,
            "floor": self.floor,
            "missing_torque": dict(self.missing_torque) if self.missing_torque is not None else None,
            "missing_torque_percent": dict(self.missing_torque_percent)
            if self.missing_torque_percent is not None
            else None,
            "small": list(self.small),
            "placebo_score": self.placebo_score,
            "noise_levels": {f"{level:g}": list(labels) for level, labels in self.noise_levels.items()},
            "paragraphs": list(self.paragraphs),
            "wall_seconds": dict(self.wall_seconds),
            "candidates": [_candidate_json(candidate) for candidate in self.candidates],
        }


def _candidate_json(candidate: Candidate) -> dict[str, Any]:
    numbers = ("p_value", "share", "validation_error", "heldout_error", "bic")
    return {
        "effect": candidate.effect,
        "owner": candidate.owner,
        "score": candidate.score,
        "dof": candidate.dof,
        **{name: _or_none(getattr(candidate, name)) for name in numbers},
        "parameters": {
            name: {"value": p.value, "sigma": _or_none(p.sigma), "unit": p.unit}
            for name, p in candidate.parameters.items()
        },
        "refitted": candidate.refitted,
        "look_alikes": list(candidate.look_alikes),
        "verdict": candidate.verdict,
        "reasons": list(candidate.reasons),
        "numerics": candidate.numerics,
    }


def _or_none(value: float) -> float | None:
    """JSON has no NaN."""
    return float(value) if np.isfinite(value) else None
