# SPDX-License-Identifier: BSD-3-Clause
"""The GTSAM graph of an arm calibrated from poses, frequency responses or both, or these with rests.

A factor for each session of poses, one for all responses with what is in doubt about them, one for each recording of
rests, and one for the priors.
"""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibration_graph import CalibrationGraph
from jointscope.graphs.frequency.calibrate_frequency import FrequencyCalibration
from jointscope.graphs.joint_kinds.calibrate_kinds import KindsCalibration
from jointscope.graphs.joint_kinds.calibrate_with_rests import WithRests
from jointscope.graphs.poses.calibrate_poses import PoseCalibration
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import SetProblem

ArmCalibration = KindsCalibration | PoseCalibration | FrequencyCalibration | WithRests


def arm_graph(result: ArmCalibration) -> CalibrationGraph:
    """The graph at the values that were found.

    Args:
        result: of `calibrate_kinds`, `calibrate_poses`, `calibrate_frequency` or `calibrate_with_rests`; of the last,
            friction stands where it is likeliest.
    """
    if isinstance(result, WithRests):
        return CalibrationGraph.of_problems(result.problems, result.solution.estimate)
    if isinstance(result, FrequencyCalibration):
        return _graph([result.summary], [Calibration.of(result.robot).only([DYNAMICS])])
    poses = result.poses if isinstance(result, KindsCalibration) else result
    problems: list[SetProblem] = list(poses.problems)
    calibrations = list(poses.calibrations)
    if isinstance(result, KindsCalibration):
        problems.append(result.summary)
        calibrations.append(result.summary.start(calibrations[0])[1])
    return _graph(problems, calibrations)


def _graph(problems: Sequence[SetProblem], calibrations: Sequence[Calibration]) -> CalibrationGraph:
    states = tuple(problem.start(at)[0] for problem, at in zip(problems, calibrations, strict=True))
    return CalibrationGraph.of_problems(problems, Estimate(states, tuple(calibrations)))
