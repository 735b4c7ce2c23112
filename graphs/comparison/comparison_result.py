# SPDX-License-Identifier: BSD-3-Clause
"""What a comparison of models with a recording found."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.external_torque import ExternalTorque
from jointscope.graphs.comparison.free_run import FreeRun, loop_error
from jointscope.graphs.problem.joint_states import JointStates
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

AHEAD, LOOP = "0.1 s ahead", "of the loop simulated from its goals"  # what a model is judged by ...
BETWEEN = "of each sensor from the others"  # ... and where links are free
SENSOR_NOISE = 1.0  # [sigma]


@dataclass(frozen=True)
class ChannelComparison:
    """How well one channel is predicted.

    Attributes:
        horizons: root mean square of measured - predicted by horizon: "0.01", "0.1", "1.0" [s] and "open_loop".
        fit_percent: 100 (1 - |measured - predicted| / |measured - mean|), norms over the recording, 0.1 s ahead.
        noise_sigma: standard deviation of the sensor.
        unit: SI unit of rmse and sigma.
    """

    horizons: Mapping[str, float]
    fit_percent: float
    noise_sigma: float
    unit: str


@dataclass(frozen=True)
class WorstWindow:
    """A stretch of time in which one channel is predicted badly.

    Attributes:
        channel: name of the channel.
        t0, t1: limits [s].
        share: share of the whole squared error (0.1 s ahead, all channels) that falls into the window.
    """

    channel: str
    t0: float
    t1: float
    share: float


@dataclass(frozen=True)
class SensorPrediction:
    """Measured and predicted samples of one sensor.

    Attributes:
        channels: names of the columns.
        units: SI unit of each.
        sigmas: standard deviation of the sensor's noise, shape (c,).
        times: sample times, shape (m,) [s].
        measured: shape (m, c).
        free: finds `open_loop`, or is it.
        ahead: predicted 0.1 s ahead from the causal state, shape (m, c); NaN where no prediction ends.
        soon: the same 0.01 s ahead, ends 0.01 s apart; None where it was not kept.
    """

    channels: tuple[str, ...]
    units: tuple[str, ...]
    sigmas: Array
    times: Array
    measured: Array
    free: Array | Callable[[], Array]
    ahead: Array
    soon: Array | None = None

    @property
    def open_loop(self) -> Array:
        """Predicted from the first state with the recorded commands alone, shape (m, c)."""
        return self.free() if callable(self.free) else self.free


@dataclass(frozen=True)
class ModelComparison:
    """One model against the recording.

    Attributes:
        label: how the user named it.
        robot: the model.
        error: root mean square over all channels of the 0.1 s ahead error in sensor sigmas.
        floor: the same from sensor noise and state uncertainty alone.
        channels: by name.
        worst: worst windows first.
        sensors: predictions by sensor name.
        floors: `floor` by channel [sensor sigma]; empty where it was not kept.
        motion: smoothed motion of the joints at all ticks; None where it was not kept.
        predicted_motion: motion 0.01 s ahead of the causal states; None where it was not kept.
        free_run: the whole recording simulated with the position controller; None for other robots.
        isolated: moments in which a torque acts that the motion does not ask for at other times.
    """

    label: str
    robot: Robot
    error: float
    floor: float
    channels: dict[str, ChannelComparison]
    worst: tuple[WorstWindow, ...]
    sensors: dict[str, SensorPrediction]
    floors: Mapping[str, float] = field(default_factory=dict)
    motion: JointStates | None = None
    predicted_motion: JointStates | None = None
    free_run: FreeRun | None = None
    isolated: tuple[ExternalTorque, ...] = ()

    @property
    def judged_by(self) -> str:
        """Whose error tells how good the model is."""
        return self.predicted if self.free_run is None else LOOP

    @property
    def predicted(self) -> str:
        """What `error` is the error of."""
        return BETWEEN if self.robot.free_links else AHEAD

    @property
    def judged_error(self) -> float:
        """That error, root mean square over its channels in sensor sigmas."""
        return self.error if self.free_run is None else loop_error(self.free_run, self.robot)

    @property
    def judged_floor(self) -> float:
        """What it would be at best: of a simulated loop no more is known than the noise of its sensor."""
        return self.floor if self.free_run is None else SENSOR_NOISE

    def to_json(self) -> dict[str, Any]:
        """The same for machines, without samples."""
        run = self.free_run
        free = {} if run is None else {"free_run": {"mean_abs": run.mean_abs, "rms": run.rms}}
        return free | {
            "error": self.error,
            "floor": self.floor,
            "channels": {
                name: {
                    "horizons": dict(c.horizons),
                    "fit_percent": c.fit_percent,
                    "noise_sigma": c.noise_sigma,
                    "unit": c.unit,
                }
                for name, c in self.channels.items()
            },
            "worst": [{"channel": w.channel, "t0": w.t0, "t1": w.t1, "share": w.share} for w in self.worst],
            "isolated": [moment.to_json() for moment in self.isolated],
        }


@dataclass(frozen=True)
class ComparisonResult:
    """All models against one recording."""

    recording: Recording
    models: tuple[ModelComparison, ...]

    def to_json(self) -> dict[str, Any]:
        """The content of `--json` as INTERFACE promises it."""
        used = {"kind": "bags", "path": self.recording.path, "sha256": self.recording.sha256}
        return {"models": {model.label: model.to_json() for model in self.models}, "recordings": [used]}
