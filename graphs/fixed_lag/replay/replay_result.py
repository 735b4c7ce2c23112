# SPDX-License-Identifier: BSD-3-Clause
"""What came out of a replay: states now and at the lag, innovations, events, latency, and agreement with the batch.

Series hold every tick of a short run and evenly thinned ones of a long run; counts, means and percentiles are always
those of all ticks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.graphs.fixed_lag.messages.status import EstimatorStatus
from jointscope.graphs.fixed_lag.replay.batch_agreement import BatchAgreement
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StateSeries:
    """Estimated states over time.

    Attributes:
        times: shape (m,) [s].
        mean: in the robot's layout, shape (m, d) [rad], [rad/s].
        sigma: standard deviations, shape (m, d).
        deflection_sigma: standard deviation of q_link - q_motor of each joint, shape (m, n) [rad].
        biases, bias_sigmas: of each gyro, shape (m, 3) [rad/s].
        parameters: value and sigma of each adapted parameter, shape (m, 2).
    """

    times: Array
    mean: Array
    sigma: Array
    deflection_sigma: Array
    biases: dict[str, Array]
    bias_sigmas: dict[str, Array]
    parameters: dict[str, Array]


@dataclass(frozen=True)
class InnovationSeries:
    """What one sensor said against what was predicted just before.

    Attributes:
        channels: names.
        units: of residual and sigma of each channel.
        times: stamps, shape (m,) [s].
        residual: measured - predicted, shape (m, c) [unit]; NaN where a channel was not looked at.
        sigma: expected standard deviation, shape (m, c) [unit].
        nis: normalised innovation squared, shape (m,).
        dof: its degrees of freedom, shape (m,).
        used: whether it went in, shape (m,).
        nis_mean: of all used innovations per degree of freedom; 1 is expected.
        dof_sum: degrees of freedom of all used innovations.
        channel_nis: mean square of residual over sigma of all used innovations, by channel.
        count: of all innovations.
    """

    channels: tuple[str, ...]
    units: tuple[str, ...]
    times: Array
    residual: Array
    sigma: Array
    nis: Array
    dof: Array
    used: NDArray[np.bool_]
    nis_mean: float
    dof_sum: float
    channel_nis: dict[str, float]
    count: int


@dataclass(frozen=True)
class Latency:
    """Wall time of all updates [s]: percentiles and the largest, and a series, shapes (m,)."""

    p50: float
    p99: float
    max: float
    mean: float
    times: Array
    seconds: Array


@dataclass(frozen=True)
class CovarianceSeries:
    """Full covariance matrices of the newest state now and then: times (m,) [s], matrices (m, d, d)."""

    times: Array
    matrices: Array


@dataclass(frozen=True)
class ReplaySource:
    """What was replayed.

    Attributes:
        path: the bag as the user gave it; empty for a recording that is no file.
        sha256: of its content.
        start_ns: stamp of time zero [ns].
        duration: from the first to the last stamp [s].
        sample_count: number of messages.
        robot: what the user typed for the robot.
    """

    path: str = ""
    sha256: str = ""
    start_ns: int = 0
    duration: float = 0.0
    sample_count: int = 0
    robot: str = ""


@dataclass(frozen=True)
class ReplayResult:
    """A replay.

    Attributes:
        robot: the model.
        lag: [s].
        updates: number of ticks.
        recording_seconds: from the first to the last stamp [s].
        wall_seconds: time in the estimator and in keeping this record; without reading and listeners [s].
        states: the newest knowledge at each tick.
        lagged: smoothed states at the lag, read at every twentieth tick or so; empty if the window never filled.
        innovations: by sensor.
        covariances: of the newest state.
        latency: of the updates.
        events: in order; the first EVENTS of them.
        event_counts: of all, by kind.
        status: of the estimator at the end.
        messages: number of messages that were fed.
        source: where they came from.
        stride: every stride-th tick is in the series.
        agreement: of the lagged states with the batch smoother; None where it was not asked for.
        no_agreement: why there is none although it was wanted.
        adapted: parameters that were allowed to walk, with their densities [unit/sqrt(s)].
    """

    robot: Robot
    lag: float
    updates: int
    recording_seconds: float
    wall_seconds: float
    states: StateSeries
    lagged: StateSeries
    innovations: dict[str, InnovationSeries]
    covariances: CovarianceSeries
    latency: Latency
    events: tuple[Event, ...]
    event_counts: dict[str, int]
    status: EstimatorStatus
    messages: int
    stride: int
    source: ReplaySource = ReplaySource()
    agreement: BatchAgreement | None = None
    no_agreement: str = ""
    adapted: dict[str, float] = field(default_factory=dict)

    @property
    def nis_mean(self) -> float:
        """Normalised innovation squared per degree of freedom over all used innovations; 1 is expected."""
        known = [s for s in self.innovations.values() if s.dof_sum]
        total = sum(s.dof_sum for s in known)
        return sum(s.nis_mean * s.dof_sum for s in known) / total if total else float("nan")

    @property
    def dropped(self) -> int:
        """Number of samples that did not go in, for whatever reason."""
        return sum(sum(kinds.values()) for kinds in self.status.dropped.values())

    @property
    def alarms(self) -> dict[str, int]:
        """How often the NIS of each sensor (or channel) left its bounds."""
        found: dict[str, int] = {}
        for event in self.events:
            if event.kind == "alarm":
                found[event.source] = found.get(event.source, 0) + 1
        return found

    def to_json(self) -> dict[str, Any]:
        """For machines; times in seconds, latencies in milliseconds."""
        latency = {name: 1e3 * getattr(self.latency, name) for name in ("p50", "p99", "max", "mean")}
        return {
            "updates": self.updates,
            "recording_seconds": self.recording_seconds,
            "wall_seconds": self.wall_seconds,
            "latency_ms": latency,
            "nis_mean": self.nis_mean,
            "dropped": self.dropped,
            "dropped_by": {name: dict(kinds) for name, kinds in self.status.dropped.items()},
            "late": dict(self.status.late),
            "received": dict(self.status.received),
            "used": dict(self.status.used),
            "lag": self.lag,
            "sensors": {
                name: {"nis_mean": s.nis_mean, "innovations": s.count, "channels": s.channel_nis}
                for name, s in self.innovations.items()
            },
            "alarms": self.alarms,
            "alarms_now": list(self.status.alarms),
            "events": [vars(event) for event in self.events],
            "event_counts": self.event_counts,
            "biases": _last(self.states.biases, self.states.bias_sigmas),
            "parameters": {
                name: {"value": float(rows[-1, 0]), "sigma": float(rows[-1, 1])}
                for name, rows in self.states.parameters.items()
                if len(rows)
            },
            "agreement": None if self.agreement is None else self.agreement.to_json(),
        }


def _last(values: dict[str, Array], sigmas: dict[str, Array]) -> dict[str, Any]:
    """The newest of each."""
    return {
        name: {"value": rows[-1].tolist(), "sigma": sigmas[name][-1].tolist()}
        for name, rows in values.items()
        if len(rows)
    }
