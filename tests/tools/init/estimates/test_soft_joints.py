# SPDX-License-Identifier: BSD-3-Clause
"""Springs are seen where two encoders say other positions; what encoders and stamps do is no spring."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.estimates.soft_joints import soft_joints

TIMES = np.arange(0.0, 8.0, 4e-3)
NOISE = 1e-4


def motion(t):
    return 0.6 * np.sin(2.0 * t) + 0.2 * np.sin(9.0 * t + 1.0)


def acceleration(t):
    return -2.4 * np.sin(2.0 * t) - 16.2 * np.sin(9.0 * t + 1.0)


def deflection(t):
    """An inertia of 0.02 kg m2 behind a spring of 100 N m/rad."""
    return 2e-4 * acceleration(t)


@pytest.mark.parametrize(
    ("motor", "soft"),
    [
        (lambda t, rng: motion(t), False),
        (lambda t, rng: motion(t) + deflection(t), True),
        (lambda t, rng: 1.01 * motion(t) + 0.3, False),
        (lambda t, rng: motion(t - 3e-3), False),
        (lambda t, rng: motion(t + 1e-3 * rng.standard_normal(len(t))), False),
    ],
    ids=["rigid", "soft", "another scale and zero", "late", "stamps that jitter"],
)
def test_only_deflections_are_soft(motor, soft):
    rng = np.random.default_rng(0)
    values = [motor(TIMES, rng), motion(TIMES)]
    noisy = [(v + NOISE * rng.standard_normal(len(TIMES)))[:, None] for v in values]
    streams = [Stream(name, TIMES, v, ("j",), "rad") for name, v in zip(("motor", "links"), noisy, strict=True)]
    assert soft_joints(*streams, np.array([1.4 * NOISE])).tolist() == [soft]


def test_streams_of_other_times_tell_nothing():
    one, other = (
        Stream(n, TIMES + d, motion(TIMES)[:, None], ("j",), "rad") for n, d in (("motor", 0.0), ("links", 99.0))
    )
    assert soft_joints(one, other, np.array([NOISE])).tolist() == [False]
