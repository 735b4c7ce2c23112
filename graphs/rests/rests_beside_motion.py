# SPDX-License-Identifier: BSD-3-Clause
"""Rests in one estimate with motion: friction with the moments of its posterior, and what the rests ask for.

The graph takes each band as its curvature at the likeliest values. Here all other recordings stand beside the bands as
the Gaussian that is left of the estimate without them, and the bands are integrated over as where rests are alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointscope.factors.calibration import DYNAMICS
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.found_values import AT_BOUND, derived_results
from jointscope.graphs.rest_sets.rest_errors import rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.band_posterior import band_posterior
from jointscope.graphs.rests.calibrate_rests import settled_rests
from jointscope.graphs.rests.doubts import AskedOfRests
from jointscope.graphs.rests.rests_by_values import SaidElsewhere
from jointscope.graphs.rests.seen_rests import SeenRests
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.starts.spring_knots import with_knots
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.rests.rests import Rests


@in_solver_context
def weighted_rests(
    robot: Robot, recordings: Sequence[Recording], rests: Sequence[Rests], progress: Progress
) -> tuple[Robot, list[RestSet]]:
    """Rests for an estimate with motion, each with the weight that it deserves, and the robot of both.

    Knots of springs lie where motion or rests deflect them: both must have the same, or one slope would be two.

    Args:
        robot: with start values.
        recordings: of motion.
        rests: of each recording; nothing is done without any.
        progress: called with a text and the share done.

    Raises:
        SolveError: as of `settled_rests`.
    """
    if not rests:
        return robot, []
    robot = with_knots(robot, [*recordings, *rests])
    return robot, settled_rests(robot, rests, progress)[0]


@in_solver_context
def with_rests(result: CalibrationResult) -> CalibrationResult:
    """The result with the posterior of its rests and what they say; as it is without rests.

    Raises:
        SolveError: a band that closes at a rest.
    """
    own = [(problem, x, at.only([DYNAMICS])) for problem, x, at in result.sets if isinstance(problem, RestSet)]
    if not own:
        return result
    robot, count = result.start, len(own[0][2].names)
    whole, x, likeliest = RestSet.joined([problem for problem, *_ in own]), np.vstack([x for _, x, _ in own]), own[0][2]
    sigmas = np.array([p.sigma for p in result.parameters[:count]])
    covariance = result.correlation[:count, :count] * np.outer(sigmas, sigmas)
    elsewhere = SaidElsewhere.of(whole, x, likeliest, covariance)
    at, found = band_posterior(whole, robot, x, likeliest, elsewhere)
    scale, free = at.value_by_coordinate, at.by_name
    spread = dict(zip(at.names, (np.sqrt(np.diag(found)) * scale).tolist(), strict=True))
    parameters = tuple(
        replace(p, value=free[p.name], sigma=spread[p.name]) if p.name in free and p.note != AT_BOUND else p
        for p in result.parameters
    )
    calibrated = result.robot.with_values({p.name: p.value for p in parameters[:count]})
    values = with_sigmas(calibrated.parameters, {p.name: p.sigma for p in parameters[:count]})
    calibrated = replace(calibrated, parameters=values)
    problems = [problem.of_robot(calibrated) for problem, *_ in own]
    asked = AskedOfRests.of(whole, robot, x, likeliest, elsewhere)
    seen = SeenRests(
        calibrated,
        robot,
        problems,
        parameters[:count],
        rest_errors(problems),
        asked.doubts() if asked else (),
        (),
    )
    derived = derived_results(robot, at, found)
    return replace(result, robot=calibrated, parameters=parameters, derived=derived, rests=seen)


def seen_rests(result: CalibrationResult) -> SeenRests | None:
    """What rests in the estimate say; None without rests."""
    return result.rests if isinstance(result.rests, SeenRests) else None
