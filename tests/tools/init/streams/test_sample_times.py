# SPDX-License-Identifier: BSD-3-Clause
"""Whose stamps the samples of a joint have, guessed from how smoothly it moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointscope.tools.init.streams.sample_times import guess_sample_times
from jointscope.tools.init.streams.signals import Signal, read_signals

ARMS = Path(__file__).resolve().parents[4].parent / "shared" / "data" / "real" / "hebi_arms_mit"


def bus(skew, n=2000, seed=3):
    """Three drives on a bus, the second and third asked some time after the first, and their gyroscopes."""
    rng = np.random.default_rng(seed)
    first = np.cumsum(rng.uniform(0.005, 0.015, n))
    times = [first, *(first + 0.004 + rng.uniform(-skew, skew, n) for _ in range(2))]
    q = [0.5 * np.sin(3.0 * t + k) + rng.normal(0.0, 1e-4, n) for k, t in enumerate(times)]
    names = ("a", "b", "c")
    positions = Signal("/joints", "sensor_msgs/msg/JointState", "position", names, first, np.column_stack(q), True)
    gyros = {
        f"imu{k + 1}": Signal(f"/imu{k + 1}", "sensor_msgs/msg/Imu", "angular_velocity", (), t, np.zeros((n, 3)), True)
        for k, t in enumerate(times)
    }
    return positions, names, gyros


def test_every_joint_gets_the_gyroscope_of_its_drive():
    positions, names, gyros = bus(skew=3e-3)
    del gyros["imu1"]
    assert guess_sample_times(positions, names, gyros) == ("message", "imu2", "imu3")


def test_one_instant_for_all_needs_no_other_stamps():
    assert guess_sample_times(*bus(skew=0.0)) == ()


def test_gyroscopes_with_other_numbers_of_messages_are_not_asked():
    positions, names, gyros = bus(skew=3e-3)
    short = {k: Signal(g.topic, g.msgtype, g.field, (), g.times[1:], g.values[1:], True) for k, g in gyros.items()}
    assert guess_sample_times(positions, names, short) == ()


@pytest.mark.skipif(not ARMS.is_dir(), reason=f"{ARMS} does not exist: real recordings do not come with the project")
@pytest.mark.parametrize("bag", ["arm5_capstone_robot_data", "arm5_milestone_repeat_waypoints", "arm3_ps5_robot_data"])
def test_modules_of_real_arms_get_their_own_gyroscope_or_none(bag):
    signals = read_signals(ARMS / bag)
    positions = next(s for s in signals if (s.topic, s.field) == ("/link_states", "position"))
    gyros = {s.topic.split("/")[1]: s for s in signals if "imu" in s.topic}
    found = guess_sample_times(positions, positions.names, gyros)
    own = [f"imu{j + 1}" for j in range(len(found))]
    assert all(name in ("message", mine) for name, mine in zip(found, own, strict=True))
    assert sum(name != "message" for name in found) >= 2
