# SPDX-License-Identifier: BSD-3-Clause
"""The noise that samples show by themselves: no jitter of their stamps is taken for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, moved, robot_file

from jointscope.graphs.calibration.encoder_noise import with_visible_noise
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream

ARM = Arm("y", inertia=(0.7,), dry=(2.0,), viscous=(1.5,))


@pytest.mark.parametrize("jitter", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("sigma", [2e-5, 2e-4])
def test_the_visible_noise_of_a_fast_motion_is_its_own(tmp_path, jitter, sigma):
    rng = np.random.default_rng(3)
    fine, command = moved(ARM, encoder_rate=2000.0, command_rate=100.0, noise=0.0)
    times = np.arange(0.1, 7.8, 0.008) + rng.uniform(0.0, 0.008 * jitter, len(np.arange(0.1, 7.8, 0.008)))
    values = np.interp(times, fine.times, fine.values[:, 0]) + rng.normal(0.0, sigma, len(times))
    stream = Stream("encoder", times, values[:, None], ARM.joints, "rad")
    recording = Recording("", "", 10**18, {"encoder": stream, "command": command})
    robot = load_robot(robot_file(ARM, tmp_path))
    small = robot.with_sensors({"encoder": replace(robot.motor_encoder, sigmas=np.array([1e-6]))})
    found = with_visible_noise(small, [recording]).motor_encoder.sigmas
    assert found == pytest.approx([sigma], rel=0.2)
