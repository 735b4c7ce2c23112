# SPDX-License-Identifier: BSD-3-Clause
"""Half of the play of an encoder, from recordings that MuJoCo made, whose magnet is pushed along in fine steps."""

from __future__ import annotations

import pytest

import jointscope as js
from jointscope.graphs.refits.validation import heldout_error
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("robot", "owner", "half", "seconds"),
    [("doggy", "joint2", 4e-4, 8.0), ("biorob", "joint3.link", 2e-3, 6.0)],  # five or six sigmas of the encoder
)
def test_the_play_is_found_with_an_honest_sigma_and_predictions_are_those_of_its_true_size(robot, owner, half, seconds):
    label = f"encoder_hysteresis@{owner}"
    train, moves = (
        js.simulate(robot, motion=motion, seconds=t, seed=3, effects=[f"{label}:half_play={half}"]).recording
        for motion, t in (("calibration", seconds), ("moves", 3.0))
    )
    arm = load_robot(robot)
    found = js.calibrate(add_effect(arm, label), train).robot
    play = found.parameters[f"{owner}.encoder_hysteresis.half_play"]
    assert abs(play.value - half) < 3.0 * play.sigma
    assert abs(play.value - half) < 0.1 * half
    error = heldout_error(found, moves)
    assert error < 1.1 * heldout_error(found.with_values({play.name: half}), moves)
    assert error < 0.9 * heldout_error(js.calibrate(arm, train).robot, moves)
