# SPDX-License-Identifier: BSD-3-Clause
"""A simulated Doggy whose calibration is perfect, and its messages in the order of their stamps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from jointscope.graphs.fixed_lag import EstimatedState, FixedLagEstimator
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot

DISTURBANCE = 0.3  # [N m] of every link and motor, at 1 kHz
ORDER = ("command", "motor_encoder", "imu1", "imu2")
Message = tuple[str, float, np.ndarray]


@dataclass(frozen=True)
class Run:
    """What really happened.

    Attributes:
        robot: with the simulation's own parameters, mountings and noise.
        recording: what the sensors said.
        states: (q_link, v_link, q_motor, v_motor) at every millisecond.
    """

    robot: Robot
    recording: object
    states: np.ndarray

    def messages(self, begin: float = 0.0, end: float = np.inf) -> list[Message]:
        """Name, stamp, values; commands before what was measured at the same time."""
        found = [
            (ORDER.index(name), name, t, values)
            for name, stream in self.recording.streams.items()
            for t, values in zip(stream.times.tolist(), stream.values, strict=True)
            if begin <= t < end
        ]
        found.sort(key=lambda m: (m[2], m[0]))
        return [m[1:] for m in found]

    def truth(self, t: float) -> np.ndarray:
        """State at a time between the milliseconds, shape (12,)."""
        return np.array([np.interp(t, np.arange(len(self.states)) * 1e-3, x) for x in self.states.T])

    def error(self, state: EstimatedState) -> np.ndarray:
        """Estimated minus true, in standard deviations, shape (12,)."""
        return (state.mean[:12] - self.truth(state.time)) / state.sigma[:12]

    def nees(self, state: EstimatedState) -> float:
        """Normalised error squared per degree of freedom."""
        e = state.mean[:12] - self.truth(state.time)
        return float(e @ np.linalg.solve(state.covariance[:12, :12], e)) / len(e)


def simulated_run(
    motion: str = "moves", seconds: float = 2.5, seed: int = 5, memory: float = 0.0, **options: float
) -> Run:
    """A recording with disturbances, white or with a memory [s], and the robot as it was."""
    from jointscope.tools.simulator import Disturbance, simulate

    robot = load_robot("doggy")
    disturbance = Disturbance(link=DISTURBANCE, motor=DISTURBANCE, correlation_time=memory)
    sim = simulate(robot, motion, seconds, seed, friction="smooth", disturbance=disturbance, **options)
    true = sim.truth["parameters"]
    robot = robot.with_values({name: float(value) for name, value in true.items() if name in robot.parameters})
    robot = robot.with_sensors(
        {g.name: replace(g, R_imu_body=np.array(true[f"{g.name}.R_imu_body"])) for g in robot.gyros}
    )
    M = robot.kinematic_tree.mass_matrix(np.zeros((1, 3)))[0]
    alone = 1.0 / np.diag(np.linalg.inv(M))
    inertia = np.array([robot.drive_parameter(joint, "inertia").value for joint in robot.joints])
    per_root_second = DISTURBANCE * np.sqrt(1e-3)
    noise = replace(
        robot.noise, link_velocity=per_root_second / alone, motor_velocity=per_root_second / inertia, estimate=False
    )
    if memory:
        noise = replace(noise, link_velocity=np.full(3, 3e-3), motor_velocity=np.full(3, 3e-3))
        noise = noise.with_lasting(memory, DISTURBANCE / np.concatenate([alone, inertia]))
    return Run(replace(robot, noise=noise), sim.recording, sim.states)


def feed(
    est: FixedLagEstimator, messages: Iterable[Message], look: Callable[[float], object] | None = None
) -> FixedLagEstimator:
    """Gives messages to an estimator; after those of a millisecond `look` is called with its stamp."""
    last = None
    for name, t, values in messages:
        if look is not None and last is not None and t > last + 5e-4:
            look(last)
        last = t
        est.sample(name, t, values)
    return est


def dropped(est: FixedLagEstimator, kind: str) -> dict[str, int]:
    """How many messages of each stream were dropped as this kind."""
    return {name: kinds[kind] for name, kinds in est.status.dropped.items() if kinds[kind]}


def told(est: FixedLagEstimator, kind: str) -> list[str]:
    """Texts of all events of a kind."""
    return [event.text for event in est.events if event.kind == kind]
