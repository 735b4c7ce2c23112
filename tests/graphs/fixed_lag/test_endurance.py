# SPDX-License-Identifier: BSD-3-Clause
"""Nothing that comes may raise, lock the estimator in, or let it grow."""

from __future__ import annotations

import sys
from collections import Counter, deque

import numpy as np
import pytest
from online_doggy import feed

from jointscope.graphs.fixed_lag import FixedLagEstimator
from jointscope.robots.files.robot_file import load_robot

NAMES = ("command", "motor_encoder", "imu1", "imu2")
ODDITIES = {
    "none": 60.0,
    "one value is not a number": 2.0,
    "all values are infinite": 1.0,
    "huge values": 2.0,
    "ahead": 1.0,
    "late": 4.0,
    "repeated stamp": 3.0,
    "far ahead": 0.15,
    "far back": 0.3,
    "the clock was set": 0.1,
    "no stamp": 0.8,
    "nearly the same stamp": 2.0,
}


def random_messages(seed, count):
    """Messages of a robot at rest, most of them right."""
    rng = np.random.default_rng(seed)
    weights = np.array(list(ODDITIES.values()))
    t, last = 0.0, 0.0
    for _ in range(count):
        t += rng.exponential(3e-4)
        name = NAMES[rng.integers(4)]
        values = rng.normal(size=3) * {"command": 0.2, "motor_encoder": 1e-4}.get(name, 2e-3)
        odd = list(ODDITIES)[rng.choice(len(weights), p=weights / weights.sum())]
        stamp = t
        if odd == "one value is not a number":
            values[rng.integers(3)] = np.nan
        elif odd == "all values are infinite":
            values[:] = rng.choice([-np.inf, np.inf])
        elif odd == "huge values":
            values *= 10.0 ** rng.integers(3, 308)
        elif odd == "ahead":
            stamp = t + rng.uniform(0.0, 0.5)
        elif odd == "late":
            stamp = t - rng.uniform(0.0, 0.3)
        elif odd == "repeated stamp":
            stamp = last
        elif odd == "far ahead":
            stamp = t + 10.0 ** rng.integers(1, 12)
        elif odd == "far back":
            stamp = t - 10.0 ** rng.integers(1, 12)
        elif odd == "the clock was set":
            stamp = t = t - rng.uniform(0.0, t + 1.0)
        elif odd == "no stamp":
            stamp = rng.choice([np.nan, np.inf, -np.inf])
        elif odd == "nearly the same stamp":
            stamp = t + 1e-9 * rng.uniform()
        last = stamp
        yield name, float(stamp), values


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("seed", range(6))
def test_random_messages_never_raise_and_the_state_stays_possible(seed):
    est = FixedLagEstimator(load_robot("doggy"), 0.1)
    for i, (name, t, values) in enumerate(random_messages(seed, 800)):
        est.sample(name, t, values)
        if i % 7 == 0:
            state = est.state()
            if est.status.running:
                assert np.isfinite(state.mean).all() and np.isfinite(state.covariance).all()
                assert np.linalg.eigvalsh(state.covariance / np.outer(state.sigma, state.sigma)).min() > -1e-9
        if i % 49 == 0:
            est.smoothed()
    # then all is well again
    begin = est.state().time if est.status.running else 50.0
    rng = np.random.default_rng(seed)
    for k in range(300):
        t = begin + 1e-3 * k
        est.command(t, np.zeros(3))
        est.encoder(t, rng.normal(0.0, 7e-5, 3))
        for imu in ("imu1", "imu2"):
            est.gyro(imu, t, rng.normal(0.0, 1.7e-3, 3))
    assert est.status.running
    assert est.state().time == pytest.approx(begin + 0.299, abs=2e-3)
    assert np.all(est.state().sigma[est.layout.motor_q] < 1e-4)


def test_an_estimate_that_contradicts_the_encoders_begins_anew(run):
    """Commands that never reached the motors, a hundred times too large."""
    est = FixedLagEstimator(run.robot, 0.1)
    wrong = [(n, t, v + 100.0 * np.sign(v) if n == "command" and t > 0.8 else v) for n, t, v in run.messages(0.6, 1.1)]
    feed(est, wrong)
    assert est.status.restarts >= 1 or est.status.alarms
    feed(est, run.messages(1.1, 1.5))
    state = est.state()
    assert est.status.running
    assert run.nees(state) < 4.0


def contents(thing, seen, found, path):
    """Sizes of all containers of this package's objects."""
    if id(thing) in seen:
        return
    seen.add(id(thing))
    if isinstance(thing, list | dict | deque | set | Counter):
        found[path] = len(thing)
        parts = list(thing.values()) if isinstance(thing, dict) else list(thing)
        for part in parts[:3]:
            contents(part, seen, found, f"{path}[]")
    elif type(thing).__module__.startswith("jointscope.graphs.fixed_lag"):
        for name, value in vars(thing).items():
            contents(value, seen, found, f"{path}.{name}")


def test_memory_is_bounded():
    """Four seconds of a noisy, lossy, late robot: containers are as large after it as after the first third."""
    est = FixedLagEstimator(load_robot("doggy"), 0.02)
    rng, sizes, keys = np.random.default_rng(1), [], []
    for k in range(2100):
        t = 2e-3 * k
        if rng.uniform() > 0.1:
            est.command(t - (4e-3 if rng.uniform() < 0.02 else 0.0) + 1e-7 * rng.uniform(), rng.normal(0.0, 0.01, 3))
        if rng.uniform() > 0.1:
            est.encoder(t, rng.normal(0.0, 7e-5, 3) + (0.1 if rng.uniform() < 0.01 else 0.0))
        if k % 5 == 0:
            est.gyro("imu1", t - (5e-3 if rng.uniform() < 0.05 else 0.0) + 1e-8, rng.normal(0.0, 1.7e-3, 3))
        if k in (699, 1399, 2099):
            found = {}
            contents(est, set(), found, "est")
            sizes.append(found)
            keys.append(est._engine.window._smoother.getFactors().size())
    assert est.status.running and est.status.restarts == 0
    bounded = {"est._books.log.events", "est._books.intake._checks[]._stamps", "est._books.intake._checks[]._order"}
    limit = {name: 5000 if name in bounded or "_stamps" in name or "_order" in name else 1000 for name in sizes[-1]}
    assert all(size <= limit[name] for name, size in sizes[-1].items())
    grown = {
        name: (sizes[0].get(name, 0), size)
        for name, size in sizes[-1].items()
        if size > sizes[0].get(name, 0) + 60 and name not in bounded and "_stamps" not in name and "_order" not in name
    }
    assert not grown
    assert keys[-1] < 2 * keys[0] + 100
    assert sys.getsizeof(est.status.received) < 5000
