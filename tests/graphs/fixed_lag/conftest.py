# SPDX-License-Identifier: BSD-3-Clause
"""One simulated run that all tests of the estimator share."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="session")
def run():
    """Ball-hitting moves, from rest; motion begins at half a second."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from online_doggy import simulated_run

    return simulated_run(seconds=1.6)


@pytest.fixture(scope="session")
def odd_run():
    """The same with gyros at 200 Hz, and all sensors sampled between the commands."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from online_doggy import simulated_run

    return simulated_run(seconds=1.1, seed=6, gyro_rate=200.0, jitter=2e-4)
