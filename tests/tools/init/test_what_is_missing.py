# SPDX-License-Identifier: BSD-3-Clause
"""A cable, a load, a push and a base that is not level each have their own name where the regression fails."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, moved, robot_file

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.init.what_is_missing import NOTHING, what_is_missing

ARM = Arm()


def taken_up(t, u, model, _):
    model.body_mass[-1] = 3.0 * 0.6**2 + (0.8 if t > 4.0 else 0.0)
    return u


def no_law(t, u, _, __):
    return u + 3.0 * np.sin(7.3 * t)


@pytest.mark.parametrize(
    ("arm", "how", "said"),
    [
        (ARM, {"cable": 6.0}, r"it looks like spring beside the drive: jointscope add \S*arm.yaml parallel_spring@j0"),
        (ARM, {"drive": taken_up}, r"from (4.0|3.9)\d s on the arm carries something else"),
        (ARM, {"push": (3.0, 5.0, 1, 9.0)}, r"from (3.0|2.9)\d s to (5.0|4.9)\d s something pushes on the arm"),
        (
            replace(ARM, gravity=(1.8, 0.0, -9.64)),
            {},
            # of the first joint another zero is the same
            r"j0 seems to read -0.18 rad too much: .*, or the base seems not to be level \(gravity_direction@robot",
        ),
        (ARM, {"drive": no_law}, NOTHING),
    ],
    ids=["cable", "load", "push", "tilt", "no law"],
)
def test_what_is_missing_has_its_own_name(tmp_path, arm, how, said):
    encoder, command = moved(arm, seconds=10.0, encoder_rate=250.0, command_rate=250.0, **how)
    recording = Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})
    text = what_is_missing(load_robot(robot_file(ARM, tmp_path)), recording, ["j1"])
    assert re.search(said, text), text
