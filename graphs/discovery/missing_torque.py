# SPDX-License-Identifier: BSD-3-Clause
"""The torque that a model lacks in each equation of motion, over time, beside the motion at which it appeared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, rotation_block
from jointscope.graphs.comparison.compare import smooth
from jointscope.graphs.discovery.explained_torque import explained_torque, spring_and_drive
from jointscope.graphs.noise.lasting_noise import separate_noise
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import first_step, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.robots.model.lasting_torques import equation_inertias
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.units import of_slide

Array = NDArray[np.float64]

LASTING = 0.03  # [s] correlation time; 0.01 leaves twice the sigma, and 0.97 instead of 0.99 of a hidden friction


@dataclass(frozen=True)
class MissingTorque:
    """A smoothed torque per equation.

    Attributes:
        joints: names of the n joints.
        rows: names of the 2n equations, links first: "joint1.link", ..., "joint1.motor", ...
        times: ticks, shape (m,) [s].
        torque: to be added to the right-hand side of each equation, shape (m, 2n) [N m].
        sigma: its standard deviation, shape (m, 2n) [N m].
        q_link, v_link, q_motor, v_motor: smoothed motion, shape (m, n) each [rad], [rad/s].
        tau_spring: torque of each spring, shape (m, n) [N m].
        tau_drive: torque of each motor without friction, shape (m, n) [N m].
        explained_by: curves of the best candidates: label to torque of the row it acts on, shape (m, 2n).
        slides: names of the prismatic joints, whose torques are forces [N] and whose angles are lengths [m].
    """

    joints: tuple[str, ...]
    rows: tuple[str, ...]
    times: Array
    torque: Array
    sigma: Array
    q_link: Array
    v_link: Array
    q_motor: Array
    v_motor: Array
    tau_spring: Array
    tau_drive: Array
    explained_by: dict[str, Array]
    slides: tuple[str, ...] = ()

    def unit(self, row_or_signal: str, unit: str) -> str:
        """Unit of a quantity of the joint that a row or signal belongs to; `unit` is that of a joint that turns."""
        return of_slide(unit) if row_or_signal.split(".")[0] in self.slides else unit


@in_solver_context
def estimate_missing_torque(
    robot: Robot,
    recording: Recording,
    states: Array | None = None,
    ticks: Array | None = None,
    calibration: Calibration | None = None,
    explained_by: Mapping[str, Robot] | None = None,
) -> MissingTorque:
    """Smooths a recording with a torque that lasts in every equation of motion.

    Biases of the gyros are estimated along; parameters and mounting stay. A rigid joint has one equation for motor and
    link: its missing torque stands in the link's row, that of the motor is zero.

    Args:
        robot: the model.
        recording: the data.
        states: smoothed states of the model, shape (m, d); found here if they are not given.
        ticks: of these states, where some divide steps, shape (m,) [s].
        calibration: shared values with the biases of the recording; needed with `states`.
        explained_by: refitted models by the label of their effect, for the curves of `explained_by`.

    Raises:
        SolveError: the states of the recording cannot be estimated.
    """
    if states is None or calibration is None:
        problem, states, calibration = smooth(robot, recording)
    else:
        problem = BagProblem.of(robot, recording, ticks)
    free = separate_noise(problem, states, calibration, LASTING).robot
    x, sigmas = _smoothed(problem.of_robot(free), problem, states, calibration)
    return _answer(problem, free, x, sigmas, explained_by or {})


def _answer(
    problem: BagProblem, free: Robot, x: Array, sigmas: Array, explained_by: Mapping[str, Robot]
) -> MissingTorque:
    """Puts together torques and motion from states with lasting torques and their sigmas, shape (m, d) each."""
    joints, layout = free.joints, free.layout
    rows = tuple(f"{joint}.{side}" for side in ("link", "motor") for joint in joints)
    torque, sigma = np.zeros((2, len(x), len(rows)))
    first = layout.size - free.noise.n_lasting
    for i, inertia in enumerate(equation_inertias(free).tolist()):
        name = layout.rate_names[i]
        if name in rows:  # hinges of a bearing are no joints
            for found, of in ((torque, x), (sigma, sigmas)):
                found[:, rows.index(name)] = inertia * of[:, first + i]
    q_link, v_link, q_motor, v_motor = np.split(layout.by_joint(x), 4, axis=1)
    own = problem.robot.layout.carried_over(x, layout)
    tau_spring, tau_drive = spring_and_drive(problem, own)
    return MissingTorque(
        joints=joints,
        rows=rows,
        times=problem.timeline.ticks,
        torque=torque,
        sigma=sigma,
        q_link=q_link,
        v_link=v_link,
        q_motor=q_motor,
        v_motor=v_motor,
        tau_spring=tau_spring,
        tau_drive=tau_drive,
        explained_by={label: explained_torque(other, label, problem, own) for label, other in explained_by.items()},
        slides=problem.robot.tree.slides,
    )


def _smoothed(free: BagProblem, own: BagProblem, states: Array, calibration: Calibration) -> tuple[Array, Array]:
    """States with lasting torques and their standard deviations, shape (m, d) each."""
    hold = (DYNAMICS, *(rotation_block(gyro.name) for gyro in free.robot.gyros))
    known = Calibration.of(free.robot).with_points({b: calibration[b] for b in calibration.blocks if b != DYNAMICS})
    start = Estimate((free.robot.layout.carried_over(states, own.robot.layout),), (known,))
    near = first_step([free], start, hold) or start
    solution = solve([free], near, max_iterations=1, hold=hold)
    (found,), _ = posteriors([free], solution, hold)
    return solution.estimate.states[0], found.sigmas
