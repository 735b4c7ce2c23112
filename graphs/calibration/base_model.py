# SPDX-License-Identifier: BSD-3-Clause
"""A calibrated model together with what it makes of its training recordings; where every diagnosis begins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.stages.near_solution import NearSolution
from jointscope.graphs.noise.lasting_noise import without_lasting
from jointscope.graphs.problem.bag_problem import BagProblem, first_command_time
from jointscope.graphs.problem.standstill import holding_sharpness
from jointscope.graphs.problem.timeline import Timeline
from jointscope.graphs.solving.batch_solver import Solver, solve
from jointscope.robots.model.encoder_plays import unlagged
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.state_layout import StateLayout
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

CYCLE = 4.0  # [s] of motion that holds one piece for fitting and one for validation
FIT_SHARE = 0.45  # of each cycle
FEWEST_CYCLES = 2


@dataclass(frozen=True)
class Span:
    """A stretch of one recording.

    Attributes:
        bag: index of the recording.
        t0, t1: limits [s].
    """

    bag: int
    t0: float
    t1: float


@dataclass(frozen=True)
class BaseModel:
    """A model calibrated with all training recordings.

    Attributes:
        robot: calibrated; every gyro predicted in full.
        recordings: the training recordings.
        states: smoothed states of each, shape (m + 1, d).
        calibrations: shared values with the biases of each.
        result: the calibration.
        by_torques: whether what it lacks is asked of the torque that is missing while its joints move; friction at rest
            has no say then. Where predictions are asked, which go through standstills, it has.
    """

    robot: Robot
    recordings: tuple[Recording, ...]
    states: tuple[Array, ...]
    calibrations: tuple[Calibration, ...]
    result: CalibrationResult
    by_torques: bool = False

    @staticmethod
    def of(
        robot: Robot,
        recordings: Sequence[Recording],
        start: BaseModel | None = None,
        *,
        by_torques: bool | None = None,
        follow: bool = False,
        solver: Solver = solve,
        calibration: Callable[..., CalibrationResult] = calibrate,
    ) -> BaseModel:
        """Calibrates a robot.

        Args:
            robot: the model with start values.
            recordings: training recordings.
            start: a model of the same recordings whose values are near; nothing is guessed anew.
            follow: whether its states are taken over, too, where both have the same springs and bearings. Those of a
                model without a spring hold its motor where the joint is, and no step leads from there.
            by_torques: see there; as the start where there is one, else wherever the robot allows it.
            solver: minimises the cost of all samples.
            calibration: `calibrate`, or what calibrates with recordings of other kinds in the same graph.
        """
        if by_torques is None:
            by_torques = start.by_torques if start is not None else seen_by_one_encoder(robot)
        # no column of the score test says what these would see
        full = with_full_gyros(robot).without([s for s in (robot.torque_sensor, robot.motor_current) if s is not None])
        full = without_lasting(full)  # what is missing must not hide in torques that last
        full = holding_sharpness(full, recordings)  # nor in a friction that is rounded off
        states = start.states_for(full) if start is not None and follow else ()
        near = None if start is None else NearSolution(start.calibrations, states)
        # motors behind which links swing that nobody sees tell of these while they move
        moving = by_torques or (seen_by_one_encoder(full) and len(full.noise.unseen) > 0)
        result = calibration(full, recordings, near=near, standstill=not moving, memory=False, solver=solver)
        return BaseModel(
            result.robot,
            tuple(recordings),
            tuple(bag.states for bag in result.bags),
            tuple(bag.calibration for bag in result.bags),
            result,
            by_torques,
        )

    @property
    def layout(self) -> StateLayout:
        """Of the states."""
        return self.robot.layout

    def problem(self, bag: int) -> BagProblem:
        """Factors of one recording."""
        return BagProblem.of(self.robot, self.recordings[bag], self.between(bag))

    def between(self, bag: int) -> Array | None:
        """Ticks of a recording that divide its steps, shape (k,) [s]; None where none does."""
        whole = Timeline.of(self.result.bags[bag].recording, self.robot.command_held).ticks
        dividing = np.setdiff1d(self.problem_ticks(bag), whole)
        return dividing if len(dividing) else None

    def states_at(self, bag: int, ticks: Array, layout: StateLayout) -> Array:
        """Smoothed states at other ticks of a recording, in another layout, shape (k, d)."""
        own = self.problem_ticks(bag)
        x = np.column_stack([np.interp(ticks, own, column) for column in self.states[bag].T])
        return layout.carried_over(x, self.layout)

    def states_for(self, robot: Robot) -> tuple[Array, ...]:
        """Smoothed states of each recording in the layout of another robot, shape (m + 1, d); none of other bodies."""
        if (robot.layout.links, robot.layout.motors) != (self.layout.links, self.layout.motors):
            return ()
        same = [robot.layout.carried_over(x, self.layout) for x in self.states]
        return tuple(unlagged(robot, x, known=self.layout.memories) for x in same)

    def problem_ticks(self, bag: int) -> Array:
        """Ticks of a recording, shape (m + 1,) [s]."""
        return self.result.bags[bag].ticks

    def spans(self) -> tuple[list[Span], list[Span]]:
        """Pieces for fitting and pieces for validation, in turn."""
        fit, validation = [], []
        for bag, recording in enumerate(self.recordings):
            start, end = first_command_time(recording), float(self.problem_ticks(bag)[-1])
            cycles = max(round((end - start) / CYCLE), FEWEST_CYCLES)
            length = (end - start) / cycles
            for i in range(cycles):
                t0 = start + i * length
                fit.append(Span(bag, t0, t0 + FIT_SHARE * length))
                validation.append(Span(bag, t0 + FIT_SHARE * length, t0 + length))
        return fit, validation


def seen_by_one_encoder(robot: Robot) -> bool:
    """Whether one encoder of rigid joints, or of motors behind which links swing unseen, is all that there is."""
    alone = len(robot.sensors) == 1 and robot.transmission is None
    return alone and (not robot.layout.motors or len(robot.noise.unseen) > 0)


def with_full_gyros(robot: Robot) -> Robot:
    """The robot with all components of every gyro predicted from the state: the paper's forms hide effects."""
    return robot.with_sensors({gyro.name: replace(gyro, form="full", reference=None) for gyro in robot.gyros})
