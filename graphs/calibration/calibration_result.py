# SPDX-License-Identifier: BSD-3-Clause
"""What a calibration found, in the form that files, reports and machines read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.external_torque import ExternalTorque
from jointscope.graphs.calibration.stages.history import IterationRecord
from jointscope.graphs.calibration.stages.residual_series import ResidualSeries
from jointscope.graphs.scoring.drive_timing import DriveTiming
from jointscope.graphs.scoring.lacking_effects import LackingEffect
from jointscope.graphs.scoring.regression.asked_by_regression import Asked
from jointscope.graphs.scoring.torque_readings import TorqueReading
from jointscope.graphs.scoring.wrong_masses import WrongMass
from jointscope.graphs.solving.set_problem import SetProblem
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.model.lasting_torques import lasting_torques
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.parts.shown_value import ShownValue
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class ParameterEstimate(ShownValue):
    """One calibrated number.

    Attributes:
        name: full name; rotations appear as "imu1.R_imu_body.x" (angle about that body axis away from the prior).
        value, sigma: estimate and standard deviation, in `unit`.
        unit: SI unit.
        start: value before the calibration.
        prior, prior_sigma: prior mean and standard deviation.
        published: value from the literature; None where there is none.
        note: "" or what the user must know: at a bound, held by its prior.
        derived: whether it follows from parameters and is none itself.
    """

    name: str
    value: float
    sigma: float
    unit: str
    start: float
    prior: float
    prior_sigma: float
    published: float | None = None
    note: str = ""
    derived: bool = False

    @property
    def remark(self) -> str:
        """The note."""
        return self.note


@dataclass(frozen=True)
class WeakDirection:
    """A combination of parameters that the recording determines badly.

    Attributes:
        weights: share of each parameter, largest first; relative changes of positive ones, else absolute ones [unit].
        sigma: standard deviation along the direction: relative change of the leading parameter (or [rad], [rad/s]).
        text: one sentence with names and percentages.
    """

    weights: dict[str, float]
    sigma: float
    text: str


@dataclass(frozen=True)
class ChannelFit:
    """How one measured channel is fitted by the smoothed states.

    Attributes:
        rmse: root mean square of measured - predicted [unit].
        sigma: standard deviation of the sensor [unit].
        chi2: mean square of rmse / sigma, corrected for the freedom of the states; 1 if the noise is as stated.
        unit: SI unit.
    """

    rmse: float
    sigma: float
    chi2: float
    unit: str


@dataclass(frozen=True)
class BagFit:
    """States and residuals of one recording.

    Attributes:
        recording: the data.
        calibration: shared values with this recording's biases.
        ticks: times of the states, shape (m,) [s].
        commands: command of each step, the last one repeated, shape (m, n).
        states: smoothed states (q_link, v_link, q_motor, v_motor), shape (m, 4n).
        sigmas: their standard deviations, shape (m, 4n).
        residuals: by sensor name.
        process: residual of the dynamics, one column per equation (link, motor, memories), shape (m - 1, r) [rad/s].
        process_sigma: its standard deviation, shape (m - 1, r) [rad/s].
        isolated: moments in which a torque acts that the motion does not ask for at other times.
    """

    recording: Recording
    calibration: Calibration
    ticks: Array
    commands: Array
    states: Array
    sigmas: Array
    residuals: dict[str, ResidualSeries]
    process: Array
    process_sigma: Array
    isolated: tuple[ExternalTorque, ...] = ()


@dataclass(frozen=True)
class CalibrationResult:
    """Everything a calibration found.

    Attributes:
        robot: the calibrated robot, with sigmas.
        start: the robot before.
        bags: one fit per recording.
        parameters: dynamic parameters, then rotations, then biases of the first bag ("imu1.bias.x").
        names: names of all shared values in the order of `correlation`.
        correlation: correlation matrix of all shared values, shape (s, s).
        weak_directions: badly determined combinations, worst first.
        channels: fit per channel over all bags.
        noise: estimated process noise.
        sigma_inflation: factor by which block-robust standard deviations exceed those of white noise, per parameter.
        iterations: history.
        cost: half the sum of squared whitened residuals at the end.
        samples: number of measurements used.
        recording_seconds: length of all recordings together [s].
        wall_seconds: time the calibration took [s].
        findings: sentences for the user, most important first.
        converged: False where the model contradicts the recordings so much that the values never came to rest.
        unsettled: last step, where the iterations ended before it was next to nothing [sigma]; else zero.
        masses: what the recordings say about the mass of each link, surest first.
        timing: what the recordings say about a delay of the drive signal that the model lacks; None where nothing does.
        lacking: effects of the catalogue that the recordings ask for, surest first.
        asked: what a regression of each joint alone says.
        derived: results in other words and units, which follow from the parameters.
        sets: recordings of other kinds with their states and the blocks that they touch.
        torque_readings: scales and offsets of torque sensors that the robot file has no parameters for.
        inertia_shifts: share of each inertia that too long steps made (`graphs.problem.step_errors`); None unasked.
        exchanged: sentence about joints that have each other's commands or positions.
        odd_trackers: sentences about targets whose stamps seem to be late or early, or whose tracker moved, by sensor.
        misdescribed: sentence about a transmission or a drive signal that is another one than the robot file says.
        saturated: sentence about drives that give less than was commanded, which the model takes for what acted.
        rests: what rests in the same estimate say, a `graphs.rests.seen_rests.SeenRests`; None without.
        regressed: parameters of drives as regression on the same recordings has them, where it applies.
    """

    robot: Robot
    start: Robot
    bags: tuple[BagFit, ...]
    parameters: tuple[ParameterEstimate, ...]
    names: tuple[str, ...]
    correlation: Array
    weak_directions: tuple[WeakDirection, ...]
    channels: dict[str, ChannelFit]
    noise: ProcessNoise
    sigma_inflation: dict[str, float]
    iterations: tuple[IterationRecord, ...]
    cost: float
    samples: int
    recording_seconds: float
    wall_seconds: float
    findings: tuple[str, ...] = field(default_factory=tuple)
    converged: bool = True
    unsettled: float = 0.0
    timing: DriveTiming | None = None
    masses: tuple[WrongMass, ...] = ()
    lacking: tuple[LackingEffect, ...] = ()
    asked: Asked = field(default_factory=Asked)
    regressed: Mapping[str, Value] = field(default_factory=dict)
    derived: tuple[ParameterEstimate, ...] = ()
    sets: tuple[tuple[SetProblem, Array, Calibration], ...] = ()
    torque_readings: tuple[TorqueReading, ...] = ()
    inertia_shifts: Mapping[str, float] | None = None
    exchanged: str = ""
    misdescribed: str = ""
    saturated: str = ""
    odd_trackers: dict[str, str] = field(default_factory=dict)
    rests: object = None

    @property
    def found(self) -> dict[str, Value]:
        """Values with their sigmas, by name."""
        return {p.name: Value(p.value, p.sigma) for p in self.parameters}

    @property
    def has_named_causes(self) -> bool:
        """Whether what the model lacks has names already: pushes, a delay of the drive signal, a mass, an effect."""
        late = self.timing is not None and bool(self.timing.moved(self.found))
        heavy = any(mass.moved(self.found) for mass in self.masses)
        pushed = any(bag.isolated for bag in self.bags)
        return late or heavy or self.asked.names or pushed or bool(self.torque_readings)

    def _json_lasting(self) -> dict[str, Any]:
        """Standard deviation [N m] and memory of the torques that last; empty where none do."""
        torques = lasting_torques(self.robot)
        return {"lasting_torques": {"memory": self.noise.correlation_time, "rms": torques}} if torques else {}

    def to_json(self) -> dict[str, Any]:
        """The content of `--json` as INTERFACE promises it."""
        return {
            "converged": self.converged,
            "iterations": len(self.iterations),
            "samples": self.samples,
            "recording_seconds": self.recording_seconds,
            "wall_seconds": self.wall_seconds,
            "cost": self.cost,
            "parameters": self._json_parameters(),
            "weak_directions": [{"parameters": d.weights, "sigma": d.sigma} for d in self.weak_directions],
            "channels": {
                name: {"rmse": fit.rmse, "sigma": fit.sigma, "chi2": fit.chi2, "unit": fit.unit}
                for name, fit in self.channels.items()
            },
            "noise": {}
            if self.robot.free_links
            else {
                "unit": "rad/s/sqrt(s), of joints that slide m/s/sqrt(s)"
                if self.robot.tree.slides
                else "rad/s/sqrt(s)",
                "link_velocity": list(map(float, self.noise.link_velocity)),
                "motor_velocity": list(map(float, self.noise.motor_velocity)),
                **self._json_lasting(),
            },
            "bags": [
                {"path": bag.recording.path, "sha256": bag.recording.sha256}
                | {f"{name}.bias": bias.tolist() for name, bias in bag.calibration.biases.items()}
                for bag in self.bags
            ],
            "findings": list(self.findings),
        }

    def _json_parameters(self) -> dict[str, Any]:
        """Scalars by name; biases (of the first bag) and rotations as they stand in a robot file."""
        found: dict[str, Any] = {
            p.name: {"value": p.value, "sigma": p.sigma, "unit": p.unit}
            for p in self.parameters
            if p.name in self.robot.parameters
        }
        for p in self.derived:
            found[p.name] = {"value": p.value, "sigma": p.sigma, "unit": p.unit, "derived": True}
        for sensor in self.robot.biased:
            found[f"{sensor.name}.bias"] = {
                "value": sensor.bias.tolist(),
                "sigma": None if sensor.bias_sigma is None else sensor.bias_sigma.tolist(),
                "unit": sensor.units[0],
            }
        for gyro in self.robot.gyros:
            found[f"{gyro.name}.R_imu_body"] = {
                "value": gyro.R_imu_body.tolist(),
                "sigma": None if gyro.R_sigma is None else gyro.R_sigma.tolist(),
                "unit": "1; sigma about the axes of the body [rad]",
            }
        return found
