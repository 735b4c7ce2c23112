# SPDX-License-Identifier: BSD-3-Clause
"""Stiffnesses and dampings of drives and bearings from frequency responses, with sigmas that hold what is in doubt.

First the logarithm of the response matrices, which finds the way from far; then the torque balance, stage after stage,
until the values stay. Then the responses become the Gaussian factor that holds what is in doubt, alone or with poses.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS
from jointscope.graphs.frequency.explained import Explained, explained
from jointscope.graphs.frequency.frequency_set import FrequencySet
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.frequency.settled_stages import MOST_ITERATIONS, MOST_STAGES, settled_stages
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage
from jointscope.graphs.solving.batch_solver import Progress, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas
from jointscope.robots.recordings.signals import Excitation, Signals

Array = NDArray[np.float64]
TOLD = 0.4  # of its prior's sigma: a value whose sigma stays above it is not identifiable
WELL = 0.1  # of itself, by how much a positive value that is told may be wrong; a tenth is usual for dynamic parameters


@dataclass(frozen=True)
class FrequencyCalibration:
    """Result of a calibration from frequency responses.

    Attributes:
        robot: with the values that were found and their sigmas.
        start: before.
        problems: the poses.
        names: of the free parameters, shape (p,).
        covariance: of their coordinates (logarithms of positive ones), shape (p, p).
        iterations: of all stages.
        stages: how many there were.
        cost: at the end.
        wall_seconds: of the whole.
        summary: the responses as one factor.
        settled: whether the stages came to rest; where they did not, the model lacks something that matters.
    """

    robot: Robot
    start: Robot
    problems: tuple[FrequencySet, ...]
    names: tuple[str, ...]
    covariance: Array
    iterations: int
    stages: int
    cost: float
    wall_seconds: float
    summary: FrequencySummary
    settled: bool = True

    @property
    def told(self) -> tuple[str, ...]:
        """Names of the parameters that the responses tell: well within their priors, positive ones to a tenth, too."""
        sigmas = dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))
        parameters = [self.robot.parameters[name] for name in self.names]
        most = {p.name: TOLD * p.coordinate_sigma for p in parameters}
        most |= {p.name: min(most[p.name], WELL) for p in parameters if p.positive}
        return tuple(name for name in self.names if sigmas[name] < most[name])

    @property
    def silent(self) -> tuple[str, ...]:
        """Springs, dampers and friction of the motors that they do not tell."""
        asked = {spring.stiffness for spring in self.problems[0].arm.springs}
        asked |= {spring.damping for spring in self.problems[0].arm.springs}
        return tuple(name for name in self.names if name in asked and name not in self.told)

    @cached_property
    def explained(self) -> Explained:
        """Whether the poses are explained."""
        return explained(self.robot, self.problems)

    def rms_log(self, robot: Robot) -> dict[str, Any]:
        """How far the model's matrix is from the measured one: rms of the logarithm, and of each entry."""
        parts = [p.of_robot(robot).log_errors() for p in self.problems]
        square = np.mean([np.mean(np.abs(part) ** 2, axis=0) for part in parts], axis=0)
        entries = {f"{i + 1},{j + 1}": float(np.sqrt(square[i, j])) for i, j in np.ndindex(square.shape)}
        return {"rms_log": float(np.sqrt(square.mean())), "entries": entries}

    def to_json(self) -> dict[str, Any]:
        """The content of `--json`."""
        parameters = self.robot.parameters
        table = {
            n: {"value": p.value, "sigma": p.sigma, "unit": p.unit} for n, p in parameters.items() if n in self.names
        }
        return {
            "converged": self.settled,
            "iterations": self.iterations,
            "samples": sum(problem.measured for problem in self.problems),
            "wall_seconds": self.wall_seconds,
            "cost": self.cost,
            "parameters": table,
            "told": list(self.told),
            "undetermined": [{name: 1.0} for name in self.silent],
            "explained": self.explained.to_json(),
            "frequency": self.rms_log(self.robot),
            "frequency_before": self.rms_log(self.start),
        }


@in_solver_context
def calibrate_frequency(
    robot: Robot,
    recordings: Sequence[tuple[Signals, Excitation]],
    progress: Progress | None = None,
    near: bool = False,
    most: int = MOST_STAGES,
    complete: bool = True,
) -> FrequencyCalibration:
    """Calibrates an arm from frequency responses.

    Args:
        robot: with a section `frequency`, start values and priors.
        recordings: torques of the motors that are shaken, positions of all joints, and the excitation, of each pose.
        progress: called with a text and the share done.
        near: whether the values of the robot are near the end.
        most: number of stages.
        complete: whether the model must explain most of the torques; one that lacks a spring does not.

    Raises:
        RecordingError: a recording shows no response.
        SolveError: the model explains nothing.
    """
    began, report = time.perf_counter(), progress or (lambda text, share: None)
    problems = [first_stage(robot, ShakenPose.of(*recording)) for recording in recordings]
    found_at = settled_stages(problems, [], report, near, most, complete)
    problems, solution = found_at.problems, found_at.solution
    summary = FrequencySummary.of(problems, solution.estimate.calibrations[0])
    start = Estimate(solution.estimate.states[:1], solution.estimate.calibrations[:1])
    settled = solve([summary], start, max_iterations=MOST_ITERATIONS)
    calibration = settled.estimate.calibrations[0]
    index = calibration.columns[DYNAMICS]
    covariance = np.asarray(posteriors([summary], settled)[1])[index, index]
    sigmas = np.sqrt(np.diag(covariance)) * calibration.value_by_coordinate
    found = robot.with_values(calibration.by_name)
    told = dict(zip(calibration.names, sigmas.tolist(), strict=True))
    found = found_at.told(replace(found, parameters=with_sigmas(found.parameters, told)))
    report("done", 1.0)
    return FrequencyCalibration(
        robot=found,
        start=robot,
        problems=tuple(problem.of_robot(found) for problem in problems),
        names=calibration.names,
        covariance=covariance,
        iterations=found_at.iterations,
        stages=found_at.stages,
        cost=solution.cost,
        wall_seconds=time.perf_counter() - began,
        summary=summary,
        settled=found_at.settled,
    )
