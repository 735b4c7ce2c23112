# SPDX-License-Identifier: BSD-3-Clause
"""Simulated Doggys for the estimator's benchmark: recordings with random torques, and robots that fit them.

All recordings are of one robot, mounting errors included, on different occasions: start, targets, biases, noise and
disturbance differ. So one calibration serves them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.base_model import with_full_gyros
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.lasting_torques import equation_inertias
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.simulator import Disturbance, Simulation, simulate

Array = NDArray[np.float64]

TORQUE = 0.3  # [N m] standard deviation of the disturbance on every link and every rotor, new each tick
TICK = 1e-3  # [s] for which it is held
SMALLEST = 1e-3  # [rad/s/sqrt(s)] process noise of what nothing disturbs
HELD = 3e-3  # [rad/s/sqrt(s)] that of torques which last but are held for a tick, at the most
HARDWARE = 100  # seed of the mounting errors
TRAINING = 20.0  # [s] of calibration motion


@dataclass(frozen=True)
class Case:
    """A recording and what was really going on.

    Attributes:
        robot: true parameters and mounting, and the process noise that belongs to the disturbance.
        simulation: the recording and the true states.
    """

    robot: Robot
    simulation: Simulation

    @property
    def recording(self) -> Recording:
        """What was measured."""
        return self.simulation.recording

    def truth(self, times: Array) -> Array:
        """True (q_link, v_link, q_motor, v_motor) of the joints at times of shape (m,), shape (m, 4n)."""
        ticks, states = self.simulation.state_times, self.simulation.states
        return np.column_stack([np.interp(times, ticks, column) for column in states.T])


def make_case(
    seed: int, seconds: float, *, effects: Sequence[str] = (), correlation_time: float = 0.0, quantized: bool = True
) -> Case:
    """One occasion of fast moves.

    Args:
        seed: of the occasion.
        seconds: length [s].
        effects: of the simulated robot and of the model, as ID@OWNER.
        correlation_time: of the disturbance [s]; 0 for white torques.
        quantized: whether encoders have steps.
    """
    simulation = _simulate("moves", seconds, seed, effects, correlation_time, quantized)
    return Case(_true_robot(simulation, effects, correlation_time), simulation)


def calibrated_robot(correlation_time: float = 0.0) -> Robot:
    """The robot as it comes out of `calibrate` on another occasion; its noise is what the calibration found.

    Args:
        correlation_time: of the disturbance [s]; 0 for white torques.
    """
    training = _simulate("calibration", TRAINING, HARDWARE, correlation_time=correlation_time)
    return with_full_gyros(calibrate(load_robot("doggy"), [training.recording]).robot)


def _simulate(
    motion: str,
    seconds: float,
    seed: int,
    effects: Sequence[str] = (),
    correlation_time: float = 0.0,
    quantized: bool = True,
) -> Simulation:
    disturbance = Disturbance(link=TORQUE, motor=TORQUE, correlation_time=correlation_time)
    return simulate(
        load_robot("doggy"),
        motion,
        seconds,
        seed,
        effects=effects,
        friction="smooth",
        disturbance=disturbance,
        quantized=quantized,
        hardware_seed=HARDWARE,
    )


def _true_robot(simulation: Simulation, effects: Sequence[str], correlation_time: float) -> Robot:
    robot = load_robot("doggy")
    for effect in effects:
        robot = add_effect(robot, effect)
    truth = simulation.truth["parameters"]
    robot = robot.with_values({name: float(truth[name]) for name in robot.parameters if name in truth})
    mounted = {g.name: replace(g, R_imu_body=np.array(truth[f"{g.name}.R_imu_body"])) for g in robot.gyros}
    return _with_matching_noise(with_full_gyros(robot.with_sensors(mounted)), correlation_time)


def _with_matching_noise(robot: Robot, correlation_time: float) -> Robot:
    """Torques that are drawn anew each tick are velocity noise of density torque sqrt(tick) / inertia."""
    if correlation_time:
        inertias = equation_inertias(robot)
        links, motors = np.full(robot.layout.n_link, HELD), np.full(robot.layout.n_motor, HELD)
        noise = replace(robot.noise, link_velocity=links, motor_velocity=motors, estimate=False)
        return replace(robot, noise=noise.with_lasting(correlation_time, TORQUE / inertias))
    layout, density = robot.layout, TORQUE * np.sqrt(TICK)
    M = robot.kinematic_tree.mass_matrix(np.zeros((1, layout.n_link)))[0]
    inertia_alone = 1.0 / np.diag(np.linalg.inv(M))
    link = np.full(layout.n_link, SMALLEST)
    link[layout.joint_link] = density / inertia_alone[layout.joint_link]
    motor = density / np.array([robot.drive_parameter(joint, "inertia").value for joint in layout.motors])
    noise = replace(robot.noise, link_velocity=link, motor_velocity=motor, estimate=False)
    return replace(robot, noise=noise)
