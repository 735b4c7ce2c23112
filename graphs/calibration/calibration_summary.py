# SPDX-License-Identifier: BSD-3-Clause
"""Turns a solved problem into a CalibrationResult: fits, parameter table, robot, findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from jointscope.factors.calibration import DYNAMICS, ROTATION, Calibration, bias_block, rotation_block
from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult, ChannelFit, ParameterEstimate
from jointscope.graphs.calibration.external_torque import external_torques_of
from jointscope.graphs.calibration.findings import findings
from jointscope.graphs.calibration.found_values import HELD_BY_PRIOR, derived_results, dynamic_parameters
from jointscope.graphs.calibration.identifiability import weak_directions
from jointscope.graphs.calibration.stages.history import IterationRecord
from jointscope.graphs.calibration.stages.residual_collection import BagResiduals, series_of
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.noise.robust_sigma import inflation
from jointscope.graphs.screening.exchanged_joints import EXCHANGED
from jointscope.graphs.screening.mistaken_hold import MISTAKEN_HOLD
from jointscope.graphs.screening.mistaken_transmission import MISTAKEN_TRANSMISSION
from jointscope.graphs.screening.saturated_drives import SATURATION
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.parts.sensors import AXES, Accelerometer, Gyro, LinkEncoder, MotorEncoder, Sensor
from jointscope.robots.recordings.recording import Notice
from jointscope.robots.recordings.target_plausibility import LATE_TRACKER, MOVED_TRACKER

Array = NDArray[np.float64]


def summarize(
    robot: Robot,
    solved: Solved,
    iterations: tuple[IterationRecord, ...],
    notices: Sequence[Notice],
    hold: Sequence[str],
) -> CalibrationResult:
    """Everything that users see of a calibration.

    Args:
        robot: the robot before the calibration.
        solved: the solution.
        iterations: history of all stages.
        notices: what the screening saw.
        hold: blocks that were held.
    """
    solution, shared = solved.solution, solved.solution.shared
    collected = solved.residuals
    factor = inflation([c.scores for c in collected], solved.covariance) if not hold else np.ones(shared.size)
    covariance = solved.covariance * np.outer(factor, factor)
    bags = tuple(_bag_fit(solved, i, c, factor) for i, c in enumerate(collected))
    names = shared_names(solution.estimate.calibrations, shared)
    sigmas = np.sqrt(np.diag(covariance))
    at, motions = solution.estimate, len(solved.problems)
    calibration = at.calibrations[0]
    parameters = parameter_table(robot, calibration, sigmas, shared)
    weak = () if hold else weak_directions(robot, calibration, shared, covariance)
    correlation = covariance / np.maximum(np.outer(sigmas, sigmas), 1e-300)
    noise = solved.problems[0].dynamics.steps.noise
    result = CalibrationResult(
        robot=calibrated_robot(robot, parameters, calibration, solved.robot, noise),
        start=robot,
        bags=bags,
        parameters=parameters,
        names=names,
        correlation=correlation,
        weak_directions=weak,
        channels=_channels(solved.robot, bags),
        noise=noise,
        derived=derived_results(robot, calibration, covariance),
        sets=tuple(zip(solved.sets, at.states[motions:], at.calibrations[motions:], strict=True)),
        sigma_inflation=dict(zip(names, map(float, factor), strict=True)),
        iterations=iterations,
        cost=solution.cost,
        samples=sum(len(p.factor) for problem in solved.problems for p in problem.sensors)
        + sum(other.measured for other in solved.sets),
        recording_seconds=sum(problem.recording.duration for problem in solved.problems),
        wall_seconds=0.0,
        converged=not solution.flat,
        unsettled=0.0 if solution.converged or solution.flat else solution.iterations[-1].step_in_sigmas,
    )
    said = {notice.kind: notice.text for notice in reversed(notices)}
    exchanged, saturated = said.get(EXCHANGED, ""), said.get(SATURATION, "")
    misdescribed = said.get(MISTAKEN_TRANSMISSION, said.get(MISTAKEN_HOLD, ""))
    odd = {n.stream: n.text for n in reversed(notices) if n.kind in (LATE_TRACKER, MOVED_TRACKER)}
    result = replace(result, exchanged=exchanged, saturated=saturated, misdescribed=misdescribed, odd_trackers=odd)
    return replace(result, findings=findings(result, notices))


def _bag_fit(solved: Solved, i: int, collector: BagResiduals, factor: Array) -> BagFit:
    problem, solution = solved.problems[i], solved.solution
    widening = factor[solution.shared.indices(i)]
    spread = solved.spreads[i]
    spread = replace(spread, shared=spread.shared * np.outer(widening, widening))
    residuals = {}
    for name, sensor in problem.robot.sensors.items():
        if collector.series[name]:
            residuals[name] = series_of(problem, sensor, collector.series[name])
    process = np.concatenate([r for r, _ in collector.process])
    process_sigma = np.concatenate([s for _, s in collector.process])
    u, states = problem.timeline.u, solution.estimate.states[i]
    calibration = solution.estimate.calibrations[i]
    return BagFit(
        recording=problem.recording,
        calibration=calibration,
        ticks=problem.timeline.ticks,
        commands=np.vstack([u, u[-1:]]),
        states=states,
        sigmas=spread.sigmas,
        residuals=residuals,
        process=process,
        process_sigma=process_sigma,
        isolated=external_torques_of(problem, states, calibration),
    )


def _channels(robot: Robot, bags: Sequence[BagFit]) -> dict[str, ChannelFit]:
    """Fit per channel over all recordings."""
    found = {}
    for name, sensor in robot.sensors.items():
        series = [bag.residuals[name] for bag in bags if name in bag.residuals]
        for j, channel in enumerate(series[0].channels if series else ()):
            error = np.concatenate([s.measured[:, j] - s.predicted[:, j] for s in series])
            weights = np.array([len(s.times) for s in series], float)
            chi2 = float(np.average([s.chi2[j] for s in series], weights=weights))
            found[channel] = ChannelFit(
                float(np.sqrt(np.nanmean(error**2))), float(sensor.sigmas[j]), chi2, sensor.units[j]
            )
    return found


def shared_names(calibrations: Sequence[Calibration], shared: SharedLayout) -> tuple[str, ...]:
    """Name of every shared value, with the number of the recording where several have their own."""
    names = [""] * shared.size
    starts: dict[str, set[int]] = {}
    for places in shared.places:
        for block, place in places.items():
            starts.setdefault(block, set()).add(place.start)
    for calibration, places, owner in zip(calibrations, shared.places, shared.owners, strict=True):
        for block, place in places.items():
            behind = f" (bag {owner + 1})" if len(starts[block]) > 1 else ""
            stem = block.removesuffix(ROTATION) + ".R_imu_body" if block.endswith(ROTATION) else block
            axes = AXES if calibration.block_size(block) == len(AXES) else [str(i) for i in range(len(names[place]))]
            own = calibration.names if block == DYNAMICS else [f"{stem}.{axis}" for axis in axes]
            names[place] = [name + behind for name in own]
    return tuple(names)


def parameter_table(
    robot: Robot, calibration: Calibration, sigmas: Array, shared: SharedLayout
) -> tuple[ParameterEstimate, ...]:
    """The table of all shared values (biases of the first recording)."""
    found = dynamic_parameters(robot, calibration, sigmas)
    for gyro in robot.gyros:
        start = shared.places[0][rotation_block(gyro.name)].start
        angle = Rotation.from_matrix(gyro.R_prior.T @ calibration.rotations[gyro.name]).as_rotvec()
        before = Rotation.from_matrix(gyro.R_prior.T @ gyro.R_imu_body).as_rotvec()
        for j, axis in enumerate(AXES):
            sigma = float(sigmas[start + j])
            note = "not observable, held by its prior" if sigma > HELD_BY_PRIOR * gyro.R_prior_sigma else ""
            name = f"{gyro.name}.R_imu_body.{axis}"
            row = (float(angle[j]), sigma, "rad", float(before[j]), 0.0, gyro.R_prior_sigma, None, note)
            found.append(ParameterEstimate(name, *row))
    for biased in robot.biased:
        start = shared.places[0][bias_block(biased.name)].start
        for j, axis in enumerate(AXES):
            sigma = float(sigmas[start + j])
            note = "held by its prior" if sigma > HELD_BY_PRIOR * biased.bias_prior_sigma else ""
            value, before_bias = float(calibration.biases[biased.name][j]), float(biased.bias[j])
            row = (value, sigma, biased.units[j], before_bias, before_bias, biased.bias_prior_sigma, None, note)
            found.append(ParameterEstimate(f"{biased.name}.bias.{axis}", *row))
    return tuple(found)


def calibrated_robot(
    robot: Robot,
    parameters: Sequence[ParameterEstimate],
    calibration: Calibration,
    used: Robot,
    noise: ProcessNoise,
) -> Robot:
    """The robot with values, sigmas and noise found.

    Args:
        robot: before.
        parameters: the table of values.
        calibration: biases and mountings.
        used: the robot with the noise of sensors that was used.
        noise: of the motion.
    """
    table = {p.name: p for p in parameters}
    new = {
        name: replace(p, value=table[name].value, sigma=table[name].sigma) if name in table else p
        for name, p in robot.parameters.items()
    }
    sensors: dict[str, Sensor] = {}
    for name, sensor in robot.sensors.items():
        if isinstance(sensor, Gyro):
            sensors[name] = _calibrated_gyro(sensor, calibration, table)
        elif isinstance(sensor, Accelerometer):
            bias_sigma = np.array([table[f"{name}.bias.{axis}"].sigma for axis in AXES])
            sensors[name] = replace(sensor, bias=calibration.biases[name], bias_sigma=bias_sigma)
        elif isinstance(sensor, MotorCurrent):
            sensors[name] = used.sensors[name]
        elif isinstance(sensor, MotorEncoder | LinkEncoder):
            sensors[name] = replace(sensor, sigmas=used.sensors[name].sigmas)
    return replace(robot, parameters=new, noise=noise).with_sensors(sensors)


def _calibrated_gyro(gyro: Gyro, calibration: Calibration, table: dict[str, ParameterEstimate]) -> Gyro:
    return replace(
        gyro,
        bias=calibration.biases[gyro.name],
        R_imu_body=calibration.rotations[gyro.name],
        bias_sigma=np.array([table[f"{gyro.name}.bias.{axis}"].sigma for axis in AXES]),
        R_sigma=np.array([table[f"{gyro.name}.R_imu_body.{axis}"].sigma for axis in AXES]),
    )
