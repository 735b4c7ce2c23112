# SPDX-License-Identifier: BSD-3-Clause
"""A candidate fitted on some pieces of the recordings and judged on those between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from jointscope.graphs.calibration.base_model import BaseModel, Span
from jointscope.graphs.refits.refit import Refit, refit
from jointscope.graphs.refits.validation import ValidationError, judged_error, reported_heldout_error
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore
from jointscope.robots.recordings.recording import Recording


@dataclass(frozen=True)
class ValidatedRefit:
    """A candidate that was refitted.

    Attributes:
        refit: the fit.
        validation: its errors on validation blocks.
        heldout: its error on the held-out recording; NaN without one.
    """

    refit: Refit
    validation: ValidationError
    heldout: float = float("nan")


def refit_and_validate(
    base: BaseModel,
    spans: tuple[Sequence[Span], Sequence[Span]],
    score: HypothesisScore | None = None,
    label: str = "",
    holdout: Recording | None = None,
) -> ValidatedRefit:
    """Fits a model with one more effect, and judges it.

    Args:
        base: the base model.
        spans: pieces on which it is fitted, and those on which it is judged.
        score: as of `refit`.
        label: as of `refit`.
        holdout: scored and reported.

    Raises:
        SolveError: the fit ran away.
    """
    found = refit(base, spans[0], score, label)
    errors = judged_error(base, found.robot, found.biases, spans[1])
    return ValidatedRefit(found, errors, reported_heldout_error(found.robot, holdout))


def judged_seconds(base: BaseModel, spans: Sequence[Span]) -> float:
    """Time in which predictions count [s]."""
    return float(sum((s.t1 - s.t0) * base.recordings[s.bag].judged_share(s.t0, s.t1) for s in spans))
