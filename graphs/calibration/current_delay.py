# SPDX-License-Identifier: BSD-3-Clause
"""The place of measured currents between two commands, by the states of a calibration.

    di/ddelay = k_e a_motor

Within a gap between two stamps of commands a delay moves a current only by the speed that takes current away. It
is found by linear steps together with all other values, and never leaves the gap, in which all samples see the same
commands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.calibration.stages.solved_windows import anchored
from jointscope.graphs.calibration.stages.whole_stage import WholeStage
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.screening.current_delay import current_gap
from jointscope.graphs.solving.estimate import Estimate
from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

STEPS = 4  # of the delay, each with the other values free
NEAR = 0.3  # [sigma] a step that changes nothing
PRIOR = 0.01  # [s]
CARD = Card("delay of a current", "i(t - delay)", "", "", "", "")


def solved_with_current_delay(stage: WholeStage, solved: Solved, recordings: Sequence[Recording]) -> Solved:
    """The solution with the currents where they fit best within their gap; as it is where no speed tells.

    Args:
        stage: solves.
        solved: a solution with a delay in the right gap.
        recordings: its motions.
    """
    sensor = solved.robot.motor_current
    if sensor is None or not sensor.estimate_delay or "k_mi" not in solved.robot.drive_laws:
        return solved
    gap = current_gap(solved.robot, recordings)
    if gap is None:
        return solved
    for _ in range(STEPS):
        sensor = solved.robot.motor_current
        assert sensor is not None
        step, sigma = _step(solved, sensor)
        late = float(np.clip(sensor.delay + step, gap.first, gap.last))
        if abs(late) < sigma and gap.first <= 0.0 < gap.last:
            late = 0.0
        near = abs(late - sensor.delay) < NEAR * sigma
        moved = replace(sensor, delay=sensor.delay if near else late, delay_sigma=min(sigma, gap.sigma))
        robot = solved.robot.with_sensors({sensor.name: moved})
        estimate, motions = solved.solution.estimate, len(solved.problems)
        problems = anchored([p.of_robot(robot) for p in solved.problems], estimate.calibrations)
        if near:
            noise = solved.problems[0].dynamics.steps.noise
            return replace(solved, problems=[p.with_noise(noise) for p in problems])
        start = Estimate(estimate.states[:motions], estimate.calibrations[:motions])
        solved = stage.settled(problems, solved.problems[0].dynamics.steps.noise, stage.with_sets(start))
    return solved


def _step(solved: Solved, sensor: MotorCurrent) -> tuple[float, float]:
    """A linear step of the delay with all other values and states, and its standard deviation [s]."""
    delay = EffectParameter("delay", "s", start=0.0, prior_sigma=PRIOR)
    effect = TimeShift(id="current_delay", card=CARD, parameters=(delay,), late=_late)
    test = ScoreTest.of(*solved.of_motions, solved.eliminations)
    (found,) = test.steps([EffectHypothesis(EffectAt(effect, sensor.name), (delay,))])
    return float(found.sizes[0]), float(found.sigmas[0])


def _late(stamps: Array, p: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
    """The same for all samples [s]."""
    return p["delay"] * np.ones_like(stamps), {"delay": np.ones_like(stamps)}
