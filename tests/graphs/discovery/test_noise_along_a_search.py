# SPDX-License-Identifier: BSD-3-Clause
"""A model that an effect came into has the noise of its own residuals, not that of the model before."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_arm import Arm, moved, robot_file

from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording

ARM = Arm("yx", inertia=(0.7, 0.2), dry=(2.0, 0.8), viscous=(1.5, 0.6))
CABLE = 30.0  # [N m/rad]


def test_the_noise_of_what_was_missing_leaves_with_it(tmp_path):
    encoder, command = moved(ARM, seconds=6.0, cable=CABLE, sticks=True)
    recordings = [Recording("cable.mcap", "", 10**18, {"encoder": encoder, "command": command})]
    without = load_robot(robot_file(ARM, tmp_path))
    base = BaseModel.of(without, recordings, by_torques=True)
    grown = base.robot
    for joint in ARM.joints:
        grown = add_effect(grown, f"parallel_spring@{joint}")
    grown = BaseModel.of(grown, recordings, base)
    for joint in ARM.joints:
        stiffness = grown.robot.parameters[f"{joint}.parallel_spring.stiffness"].value
        assert stiffness == pytest.approx(CABLE, rel=0.01)
    noise, before = grown.robot.noise.link_velocity, base.robot.noise.link_velocity
    assert np.all(noise < 0.3 * before)
