# SPDX-License-Identifier: BSD-3-Clause
"""An estimator that knows the truth and adds noise of the size that it claims: ticks without solving anything."""

from __future__ import annotations

import dataclasses
from collections import Counter, deque

import numpy as np

from jointscope.graphs.fixed_lag.estimated_state import EstimatedState
from jointscope.graphs.fixed_lag.messages.event import Event
from jointscope.graphs.fixed_lag.messages.status import EstimatorStatus
from jointscope.graphs.fixed_lag.tick import Tick
from jointscope.graphs.fixed_lag.window.innovation import Innovation


class FakeEstimator:
    """Takes the truth from class attributes, which a test sets, and writes down what it was fed.

    Attributes:
        truth: times, shape (m,), and states, shape (m, d).
        sick: sensors whose residuals are five times as large as claimed in the second half of the recording.
        error: factor on the errors of the lagged states.
    """

    truth = (np.zeros(2), np.zeros((2, 12)))
    sick: tuple[str, ...] = ()
    error = 1.0
    last: FakeEstimator

    def __init__(self, robot, lag=0.1, *, adapt=None, listener=None):
        type(self).last = self
        self.robot, self.lag, self.listener, self.adapt = robot, lag, listener, dict(adapt or {})
        self.fed, self.events, self.newest = [], deque(maxlen=50), {}
        self.rng = np.random.default_rng(1)
        self.counts = {kind: Counter() for kind in ("received", "used", "late")}
        self.lost = {}
        self.updates = 0
        self.pending = []
        n = robot.n
        size = np.repeat([8e-5, 9e-3, 4e-5, 7e-3], n)
        mix = np.eye(4 * n)
        mix[n : 2 * n, 3 * n :] = 0.6 * np.eye(n)
        mix[:n, 2 * n : 3 * n] = 0.4 * np.eye(n)
        C = mix @ mix.T
        scale = size / np.sqrt(np.diag(C))
        self.covariance = C * np.outer(scale, scale)
        self.root = np.linalg.cholesky(self.covariance)
        self.alarmed = False

    @property
    def status(self):
        counts = {kind: dict(count) for kind, count in self.counts.items()}
        dropped = {name: dict(kinds) for name, kinds in self.lost.items()}
        alarms = ("imu1.x",) if self.alarmed else ()
        return EstimatorStatus(updates=self.updates, running=True, dropped=dropped, alarms=alarms, **counts)

    def sample(self, name, t, values, about=None):
        self.fed.append((name, t, np.array(values)))
        self.counts["received"][name] += 1
        newest = self.newest.get(name, -np.inf)
        if t in (newest, -np.inf):
            return self.drop(name, "duplicate", t)
        if not np.all(np.isfinite(values)):
            return self.drop(name, "not_finite", t)
        if t < newest:
            self.counts["late"][name] += 1
        self.newest[name] = max(newest, t)
        self.counts["used"][name] += 1
        if name == "command":
            self.tick(t)
        else:
            self.pending.append(self.innovation(name, t))

    def drop(self, name, kind, t):
        self.lost.setdefault(name, Counter())[kind] += 1
        self.events.append(Event(t, kind, name, f"{name}: a sample of {t:.3f} s is dropped: {kind}"))

    def innovation(self, name, t):
        sensor = self.robot.sensors[name]
        sigma = 1.3 * sensor.sigmas
        factor = 5.0 if name in self.sick and t > 0.5 * self.truth[0][-1] else 1.0
        if factor > 1 and not self.alarmed:
            self.alarmed = True
            self.events.append(
                Event(t, "alarm", "imu1.x", "imu1.x: NIS 25 per degree of freedom, expected 0.8 to 1.25")
            )
        z = factor * self.rng.normal(size=3)
        return Innovation(name, t, sensor.channels, z * sigma, sigma, float(z @ z), 3, True)

    def state_at(self, t, sigmas, factor=1.0):
        times, x = self.truth
        mean = np.array([np.interp(t, times, column) for column in x.T])
        noise = factor * sigmas * (self.root @ self.rng.normal(size=len(mean)))
        wobble = 1.0 + 0.3 * np.sin(2.0 * t)
        bias = {gyro.name: np.array(gyro.bias) for gyro in self.robot.gyros}
        sigma = {gyro.name: np.full(3, 2e-4) for gyro in self.robot.gyros}
        parameters = {name: (self.robot.parameter(name).value, 0.01) for name in self.adapt}
        covariance = (sigmas * wobble) ** 2 * self.covariance
        return EstimatedState(t, mean + noise, covariance, 0.0, self.robot.layout, bias, sigma, parameters)

    def state(self, t=None):
        """Nothing is open."""

    def tick(self, t):
        if not self.updates:
            self.events.append(Event(t, "started", "estimator", "started at rest"))
        self.updates += 1
        old = t - self.lag >= self.truth[0][0]

        def smoothed(covariance=True):
            found = self.state_at(t - self.lag, 0.6, self.error) if old else None
            unknown = np.full_like(self.covariance, np.nan)
            return found if covariance or found is None else dataclasses.replace(found, covariance=unknown)

        innovations, self.pending = tuple(self.pending), []
        if self.listener:
            self.listener(Tick(self.state_at(t, 1.0), innovations, 1e-4, smoothed))
