# SPDX-License-Identifier: BSD-3-Clause
"""From messages to observations: shapes are checked, bad data are counted and told, stamps are corrected."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointscope.graphs.fixed_lag.messages.clock_watch import ClockWatch
from jointscope.graphs.fixed_lag.messages.sample_checks import SampleChecks
from jointscope.graphs.fixed_lag.messages.status import EstimatorStatus, EventLog
from jointscope.graphs.fixed_lag.window.innovation import Innovation
from jointscope.graphs.fixed_lag.window.observation import Observation
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.errors import EstimatorError
from jointscope.robots.model.lateness import Lateness, late_channels, own_delay
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Accelerometer, Gyro

Array = NDArray[np.float64]

LONGEST_DOUBT = 6  # commands in a row of which some joint lacks its own: that joint's drive may do anything then
NOISY = (Gyro, Accelerometer, MotorCurrent, PositionTarget)  # sensors that never repeat a sample, as coarse encoders do
LARGEST = 1e6  # [SI] no angle, rate or command is larger; beyond it a number is as good as none


class SampleIntake:
    """The way into the estimator.

    Args:
        robot: sensors and effects on their stamps.
        status: counts what comes and what is dropped.
        log: receives events.
        clock: tells stamps that cannot be.
    """

    def __init__(self, robot: Robot, status: EstimatorStatus, log: EventLog, clock: ClockWatch):
        self._robot, self._status, self._log, self._clock = robot, status, log, clock
        self._values = robot.values
        self._acting = np.full(robot.n, np.nan)  # last command of each joint
        self._in_doubt = 0  # commands since then
        self._checks = {"command": SampleChecks([0.0] * robot.n, False)}
        self._sigmas = {name: s.sigmas for name, s in robot.sensors.items()}
        self._groups = {name: late_channels(robot, name) for name in robot.sensors}
        self._delays = {name: own_delay(sensor) for name, sensor in robot.sensors.items()}
        for name, sensor in robot.sensors.items():
            self._checks[name] = SampleChecks(sensor.sigmas.tolist(), isinstance(sensor, NOISY))

    @property
    def waits_for_commands(self) -> bool:
        """Whether commands of some joints have come, and none yet of the others."""
        return bool(np.isnan(self._acting).any() and not np.isnan(self._acting).all())

    def command(
        self, t: float, u: ArrayLike, now: float | None, about: NDArray[np.bool_] | None = None
    ) -> Array | None:
        """A command if it can be used, shape (n,); now is the time of the estimate [s], None before there is one.

        Joints whose value is no number keep the one before, for a while; those that the message is not `about`, shape
        (n,), as long as their own driver is silent.
        """
        values = self._shaped("command", t, u, self._robot.n, now)
        if values is None:
            return None
        useless = _useless(values.tolist())
        if not useless:
            self._acting, self._in_doubt = values, 0
            return values
        bad = np.isin(np.arange(len(values)), useless)
        lost = bad if about is None else bad & about
        if not lost.any():
            self._in_doubt = 0
        else:
            self._in_doubt += 1
            joints = ", ".join(joint for joint, no_number in zip(self._robot.joints, lost, strict=True) if no_number)
            self._drop("command", t, "not_finite", f"the command of {joints} is no number and is left out")
            if lost.all() or self._in_doubt >= LONGEST_DOUBT:
                return None
        values = np.where(bad, self._acting, values)
        self._acting = values
        if np.isnan(values).any():
            if not lost.any():
                joints = ", ".join(joint for joint, u in zip(self._robot.joints, values, strict=True) if np.isnan(u))
                self._drop("command", t, "incomplete", f"no command of {joints} has come yet")
            return None
        return values

    def sample(
        self, name: str, t: float, values: ArrayLike, now: float | None, about: NDArray[np.bool_] | None = None
    ) -> list[Observation]:
        """The channels of a sample that can be used, in groups taken at the same time; now as in `command`.

        A message may be `about` some channels only, shape (c,); nothing is said about the others.
        """
        if name not in self._groups:
            known = ", ".join(["command", *self._groups])
            raise EstimatorError(f"no sensor {name!r}; robot {self._robot.name!r} has {known}")
        sensor, checks = self._robot.sensors[name], self._checks[name]
        found = self._shaped(name, t, values, len(sensor.channels), now)
        if found is None:
            return []
        numbers = found.tolist()
        bad = _useless(numbers)
        if bad:
            numbers = [math.nan if j in bad else number for j, number in enumerate(numbers)]
            lost = bad if about is None else [j for j in bad if about[j]]
            if lost:
                which = ", ".join(sensor.channels[j] for j in lost)
                self._drop(name, t, "not_finite", f"{which}: no number, left out; the rest of the message is used")
        stuck = checks.stuck(numbers)
        if stuck:
            self._drop(name, t, "stuck", f"{name} repeats one value: saturated or dead; it is left out")
        sigma = self._sigmas[name]
        shared = None if isinstance(sensor, NOISY) else checks.shared_error(t, numbers)
        if shared is not None:
            sigma = sigma * np.array(shared)
        result = []
        for channels, effects in self._groups[name]:
            if bad or stuck:
                channels = np.setdiff1d(channels, [*bad, *stuck])
            if len(channels):
                taken = t - self._delays[name] - (_lateness(effects, t, self._values) if effects else 0.0)
                whole = len(channels) == len(found)
                chosen = (found, sigma) if whole else (found[channels], sigma[channels])
                variance = Lateness(effects, found, found).variance(self._values)[0]
                result.append(Observation(name, t, taken, channels, *chosen, variance))
        return result

    def forget_stamps(self) -> None:
        """Stamps may come again: the clock was set."""
        for checks in self._checks.values():
            checks.forget()

    def too_late(self, name: str, t: float, now: float) -> None:
        """Counts a message from before the window."""
        self._drop(name, now, "too_late", f"{name}: a message came {now - t:.3f} s late, after its window")

    def is_late(self, o: Observation, now: float) -> None:
        """Counts a sample that was used although later ones had come before."""
        self._status.late[o.sensor] += 1
        self._log.tell(now, "late", o.sensor, f"{o.sensor}: a sample came {1e3 * (now - o.taken):.1f} ms late")

    def outlier(self, innovation: Innovation) -> None:
        """Counts a sample that was too far away."""
        far = float(np.max(np.abs(innovation.residual) / innovation.sigma))
        names = ", ".join(innovation.channels)
        self._drop(innovation.sensor, innovation.time, "outlier", f"{names}: {far:.0f} sigma off, taken for a glitch")

    def _shaped(self, name: str, t: float, values: ArrayLike, size: int, now: float | None) -> Array | None:
        """Values of the right shape; None if the stamp makes them useless."""
        try:
            found, finite = np.asarray(values, dtype=float), math.isfinite(t)
        except (TypeError, ValueError) as err:
            raise EstimatorError(f"{name}: expected a stamp [s] and {size} numbers, got {t!r} and {values!r}") from err
        if found.shape != (size,):
            raise EstimatorError(f"{name}: expected {size} values, got an array of shape {found.shape}")
        self._status.received[name] += 1
        if not finite:
            self._drop(name, now or 0.0, "not_finite", f"{name}: a stamp that is not finite was left out")
            return None
        misplaced = None if now is None else self._clock.misplaces(name, t, now)
        if misplaced is not None:
            self._drop(name, now or 0.0, misplaced, f"{name}: stamp {t:.3f} s does not belong to the present run")
            return None
        if self._checks[name].is_duplicate(t):
            self._drop(name, t, "duplicate", f"{name}: two messages with one stamp; the first counts")
            return None
        return found

    def _drop(self, name: str, t: float, kind: str, text: str) -> None:
        self._status.drop(name, kind)
        self._log.tell(t, kind, name, text)


def _useless(numbers: list[float]) -> list[int]:
    """Places of numbers that are not finite or impossibly large."""
    if all(-LARGEST <= number <= LARGEST for number in numbers):
        return []
    return [j for j, number in enumerate(numbers) if not -LARGEST <= number <= LARGEST]


def _lateness(effects: tuple[EffectAt, ...], t: float, values: dict[str, float]) -> float:
    """How late a stamp is by the effects of the robot file [s]."""
    stamp = np.array([t])
    return float(Lateness(effects, stamp, np.zeros(1)).since_anchor(values)[0][0])
