# SPDX-License-Identifier: BSD-3-Clause
"""What the estimator knows of the robot at one time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.window.adaptation import prior_sigmas
from jointscope.graphs.fixed_lag.window.augmented_layout import AugmentedLayout
from jointscope.graphs.fixed_lag.window.newest_state import NewestState
from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EstimatedState:
    """State with covariance.

    Attributes:
        time: when the robot is in this state [s].
        mean: in the robot's layout: q_link, v_link, q_motor, v_motor, memories, shape (d,).
        covariance: shape (d, d).
        age: time since the newest sample that went in [s]; infinite before the first.
        biases, bias_sigmas: offset of each gyro and accelerometer and its standard deviations, shape (3,) [rad/s],
            [m/s^2].
        parameters: value and standard deviation of each adapted parameter, by full name.
        layout: of the state.
    """

    time: float
    mean: Array
    covariance: Array
    age: float
    layout: StateLayout
    biases: Mapping[str, Array] = field(default_factory=dict)
    bias_sigmas: Mapping[str, Array] = field(default_factory=dict)
    parameters: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def sigma(self) -> Array:
        """Standard deviation of every component, shape (d,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def q_link(self) -> Array:
        """Link positions of the joints, shape (n,) [rad]."""
        return self.mean[self.layout.joint_q]

    @property
    def v_link(self) -> Array:
        """Link velocities of the joints, shape (n,) [rad/s]."""
        return self.mean[self.layout.joint_v]

    @property
    def q_motor(self) -> Array:
        """Motor positions in link units, shape (n,) [rad]."""
        return self.mean[self.layout.motor_q]

    @property
    def v_motor(self) -> Array:
        """Motor velocities in link units, shape (n,) [rad/s]."""
        return self.mean[self.layout.motor_v]


def state_of(layout: AugmentedLayout, time: float, found: NewestState, age: float) -> EstimatedState:
    """The estimator's whole state in the words of the robot."""
    P, d = found.covariance, layout.d
    sigma = np.sqrt(np.maximum(P.diagonal(), 0.0))
    values, sigmas = found.mean[layout.adapted].tolist(), sigma[layout.adapted].tolist()
    return EstimatedState(
        time=time,
        mean=found.mean[:d],
        covariance=P[:d, :d],
        age=age,
        layout=layout.robot,
        biases={name: found.mean[columns] for name, columns in layout.biases.items()},
        bias_sigmas={name: sigma[columns] for name, columns in layout.biases.items()},
        parameters=dict(zip(layout.parameters, zip(values, sigmas, strict=True), strict=True)),
    )


def unknown_state(robot: Robot, adapted: Sequence[str], time: float, q: Array | None, age: float) -> EstimatedState:
    """What is known without a state: last positions, shape (n,) [rad], if any; biases and parameters of the robot."""
    layout = robot.layout
    mean = np.zeros(layout.size)
    if q is not None:
        mean[layout.motor_q] = q
        mean[layout.joint_q] = joint_angles(robot, q)
    sigmas = prior_sigmas(robot, adapted).tolist()
    return EstimatedState(
        time=time,
        mean=mean,
        covariance=np.diag(np.full(layout.size, np.inf)),
        age=age,
        layout=layout,
        biases={sensor.name: sensor.bias.copy() for sensor in robot.biased},
        bias_sigmas={sensor.name: np.full(3, sensor.bias_prior_sigma) for sensor in robot.biased},
        parameters={name: (robot.parameters[name].value, s) for name, s in zip(adapted, sigmas, strict=True)},
    )
