# SPDX-License-Identifier: BSD-3-Clause
"""A candidate fitted on some pieces of the recordings and judged on those between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointscope.graphs.calibration.base_model import BaseModel, Span
from jointscope.graphs.refits.left_out import LeftOut, Missed
from jointscope.graphs.refits.refit import BegunRefit, Refit, refit
from jointscope.graphs.refits.validation import ValidationError, judged_error, reported_heldout_error
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.errors import JointscopeError
from jointscope.robots.recordings.recording import Recording

Shared = tuple[BaseModel, Sequence[Span], Sequence[Span], LeftOut | None, Recording | None]


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
    return _validated(refit(base, spans[0], score, label), base, spans, holdout)


@in_solver_context
def refit_if_it_helps(shared: Shared, score: HypothesisScore) -> ValidatedRefit | Missed | None:
    """As `refit_and_validate`, given up early where the effect makes what the fit leaves out far less likely.

    Args:
        shared: the base model, pieces on which it is fitted, those on which it is judged, what no refit is fitted to
            (without it every refit is finished), and the held-out recording.
        score: as of `refit`.

    Returns:
        None where it ran away.
    """
    base, fit, spans, left_out, holdout = shared
    try:
        begun = BegunRefit.of(base, fit, score)
        asked = begun if left_out is None else left_out.asked(begun)
        return asked if isinstance(asked, Missed) else _validated(asked.finished(), base, (fit, spans), holdout)
    except (JointscopeError, np.linalg.LinAlgError):
        return None


def _validated(
    found: Refit, base: BaseModel, spans: tuple[Sequence[Span], Sequence[Span]], holdout: Recording | None
) -> ValidatedRefit:
    errors = judged_error(base, found.robot, found.biases, spans[1])
    return ValidatedRefit(found, errors, reported_heldout_error(found.robot, holdout))


def judged_seconds(base: BaseModel, spans: Sequence[Span]) -> float:
    """Time in which predictions count [s]."""
    return float(sum((s.t1 - s.t0) * base.recordings[s.bag].judged_share(s.t0, s.t1) for s in spans))
