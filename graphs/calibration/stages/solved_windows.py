# SPDX-License-Identifier: BSD-3-Clause
"""Windows of solved recordings: what part of the samples can tell need not be asked of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.noise.lasting_noise import NoiseWindows, states_in
from jointscope.graphs.noise.torque_memory import memory_windows
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.windows import windows_of
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.starts.time_shift_start import placed
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

LONG = 25.0  # [s] of recordings, from which some windows are asked before all samples are
SHARE = 1.0 / 3.0  # of the recordings in those windows
LENGTH = 2.4  # [s] of one
MOVING = 0.5  # of the mean squared speed of each joint in the recordings, that windows must have to speak for them


@dataclass(frozen=True)
class SolvedWindows:
    """Windows of a solution.

    Attributes:
        robot: with the noise of the solution.
        pieces: the windows.
        between: ticks that the whole recording of each has between its samples, as `BagProblem.of` takes them.
        states: of each window, shape (k, d).
        calibrations: shared values of each.
    """

    robot: Robot
    pieces: list[Recording]
    between: list[Array | None]
    states: list[Array]
    calibrations: list[Calibration]

    @staticmethod
    def of(solved: Solved, windows: Sequence[tuple[int, Recording]]) -> SolvedWindows:
        """Cuts windows, given with the index of their recording, out of a solution."""
        estimate, problems = solved.solution.estimate, solved.problems
        robot = replace(solved.robot, noise=problems[0].dynamics.steps.noise)
        pieces, calibrations = [piece for _, piece in windows], [estimate.calibrations[i] for i, _ in windows]
        between = [problems[i].between for i, _ in windows]
        cut = SolvedWindows(robot, pieces, between, [], calibrations)
        whole = [(problems[i], estimate.states[i]) for i, _ in windows]
        states = [states_in(window, *of) for window, of in zip(cut.on(robot), whole, strict=True)]
        return replace(cut, states=states)

    def on(self, robot: Robot) -> list[BagProblem]:
        """The factors of all windows for a robot."""
        windows = [BagProblem.of(robot, *cut) for cut in zip(self.pieces, self.between, strict=True)]
        return anchored(windows, self.calibrations)


def noise_windows(solved: Solved) -> NoiseWindows:
    """Windows of a solution on which its noise is looked at."""
    cut = SolvedWindows.of(solved, memory_windows([p.recording for p in solved.problems]))
    return NoiseWindows(cut.robot, cut.on, cut.states, cut.calibrations)


def tested_on_windows(solved: Solved) -> ScoreTest | None:
    """A score test on a part of long recordings, spread evenly; None where all samples are asked at once.

    So they are where a joint moves elsewhere than in the windows: an effect that is not seen there is not ruled out.
    """
    recordings = [p.recording for p in solved.problems]
    seconds = sum(float(np.ptp(p.timeline.ticks)) for p in solved.problems)
    if seconds < LONG:
        return None
    try:
        cut = SolvedWindows.of(solved, windows_of(recordings, SHARE * seconds, LENGTH))
        windows, (whole, states, _) = cut.on(cut.robot), solved.of_motions
        if np.any(_squared_speeds(windows, cut.states) < MOVING * _squared_speeds(whole, states)):
            return None
        return ScoreTest.of(windows, cut.states, cut.calibrations)
    except SolveError:
        return None


def _squared_speeds(problems: Sequence[BagProblem], states: Sequence[Array]) -> Array:
    """Mean squared speed of each coordinate over all recordings, shape (k,)."""
    h, v = np.concatenate([p.timeline.h for p in problems]), problems[0].robot.layout.velocities
    return np.asarray(np.average(np.vstack([x[:-1, v] for x in states]) ** 2, axis=0, weights=h))


def anchored(problems: Sequence[BagProblem], calibrations: Sequence[Calibration]) -> list[BagProblem]:
    """The problems with samples placed where present values say, if stamps may be late."""
    robot = problems[0].robot
    if not any(isinstance(here.effect, TimeShift) for here in robot.effects):
        return list(problems)
    values = calibrations[0].by_name
    return placed(problems, values)
