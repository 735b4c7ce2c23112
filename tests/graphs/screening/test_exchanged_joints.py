# SPDX-License-Identifier: BSD-3-Clause
"""Joints with each other's commands or positions are said with the line that mends it; what else is wrong is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, divided, moved, robot_file

from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording

ARM = Arm()
ORDER = [0, 2, 1]


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return load_robot(robot_file(ARM, tmp_path_factory.mktemp("arm")))


def said(robot, encoder, command):
    notices = screen_all(Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command}), robot)
    return [notice.text for notice in notices if notice.kind in PLAIN_MISTAKES]


@pytest.mark.parametrize("constants", [(1.0, 1.0, 1.0), (8.0, 5.0, 2.0)])
def test_exchanged_commands_are_said_with_the_line_to_write(robot, constants):
    encoder, command = moved(ARM)
    (text,) = said(robot, encoder, divided(command, constants).exchanged(ORDER))
    assert "commands of j1 and j2 seem to be exchanged" in text
    assert "`names: [j0, j2, j1]` in command of " in text and "arm.yaml" in text


def test_exchanged_positions_are_said_too(robot):
    encoder, command = moved(ARM)
    (text,) = said(robot, encoder.exchanged(ORDER), command)
    assert "positions of j1 and j2 seem to be exchanged" in text
    assert "`names: [j0, j2, j1]` in sensors.encoder of " in text


def weaker(t, u, _, __):
    return u * (1.0 - 0.04 * t)


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"cable": 8.0},
        {"push": (2.0, 5.0, 1, 9.0)},
        {"drive": weaker},
        {"sticks": True, "pause": 0.3},
        {"counts": 4096},
    ],
    ids=["clean", "cable", "push", "weaker", "sticks", "counts"],
)
def test_nothing_else_is_called_exchanged(robot, how):
    encoder, command = moved(ARM, **how)
    assert not [text for text in said(robot, encoder, command) if "exchanged" in text]
    turned = replace(encoder, values=encoder.values + np.array([0.0, 0.1, 0.0]))
    assert not [text for text in said(robot, turned, command) if "exchanged" in text]
