# SPDX-License-Identifier: BSD-3-Clause
"""Share of an error that noise does not explain, and whether the floor that noise sets can be believed.

Noise that was estimated while something was missing holds part of that. A floor well above the error shows it, but for
random torques so small that no missing effect could hide in them: a model that explains all is granted some, too.
"""

from __future__ import annotations

import numpy as np

from jointscope.graphs.comparison.comparison_result import ModelComparison
from jointscope.graphs.comparison.predictions_ahead import HORIZON
from jointscope.graphs.discovery.verdicts import SENSOR_FLOOR
from jointscope.graphs.judging.torque_judge import ABSOLUTE
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.model.lasting_torques import equation_inertias
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

DOUBTFUL = 1.2  # times the error from which a floor of larger torques cannot be what noise alone would give


def believed_floor(comparison: ModelComparison, recording: Recording | None) -> float:
    """What noise alone would give [sensor sigma], the noise of the sensors where that of the model cannot be believed.

    Args:
        comparison: of a model with a recording.
        recording: the same; None where it is not at hand, then a doubtful floor is never believed.
    """
    floor = comparison.judged_floor
    if floor <= DOUBTFUL * comparison.judged_error:
        return floor
    small = recording is not None and random_torque(comparison.robot, recording) < ABSOLUTE
    return floor if small else SENSOR_FLOOR


def random_torque(robot: Robot, recording: Recording) -> float:
    """Largest torque of the white process noise, in the mean over 0.1 s, as a part of what the drive gives.

    Infinite for a drive that gives nothing, and where nothing has equations of motion.
    """
    if robot.free_links or robot.command is None:
        return float("inf")
    noise, n = robot.noise, robot.layout.n_link + robot.layout.n_motor
    densities = np.concatenate([noise.link_velocity, noise.motor_velocity])
    torques = densities * equation_inertias(robot)[:n] / np.sqrt(HORIZON)
    used = np.sqrt(np.mean(np.square(recording.command.values), axis=0))
    drives = np.abs(StateRates(robot).command_torque(used))
    own = torques[robot.layout.motor_row]
    return float(np.max(np.divide(own, drives, out=np.full(len(own), np.inf), where=drives > 0.0)))


def unexplained(comparison: ModelComparison, recording: Recording | None = None) -> float:
    """Share of a comparison's squared error that its floor does not explain."""
    return unexplained_share(comparison.judged_error, believed_floor(comparison, recording))


def unexplained_share(error: float, floor: float) -> float:
    """(error^2 - floor^2) / error^2, at least 0: an error below its floor is noise."""
    return float(max(1.0 - (floor / error) ** 2, 0.0)) if error != 0.0 else 0.0
