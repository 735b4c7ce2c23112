# SPDX-License-Identifier: BSD-3-Clause
"""Encoders on links that jump are named with time and size; blows, glitches and counters are no jumps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.screening.encoder_jumps import encoder_jumps
from jointscope.graphs.screening.screen_all import PLAIN_MISTAKES, screen_all
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Stream

ARM = load_robot("biorob")
STEP = 2.0 * np.pi / 4096


def stream(angle, rate=500.0):
    """A reading of 12 bits."""
    values = STEP * np.round(np.asarray(angle) / STEP)
    times = np.arange(len(values)) / rate
    return Stream("link_encoder", times, values[:, None], ("joint3.link_position",), "rad")


TIMES = np.arange(0.0, 6.0, 0.002)
MOTION = 0.8 * np.sin(7.0 * TIMES) + 0.1 * np.sin(25.0 * TIMES)


@pytest.mark.parametrize("size", [0.087, -0.03])
def test_a_jump_comes_out_with_time_and_size_whatever_the_joint_does(size):
    for when in np.arange(0.5, 5.5, 0.25):
        (found,) = encoder_jumps(stream(MOTION + size * (when < TIMES)))
        assert found.time == pytest.approx(when, abs=0.003)
        assert found.size == pytest.approx(size, abs=3.0 * STEP)


def test_blows_glitches_holes_and_stairs_are_no_jumps():
    blow = 3.0 * np.maximum(TIMES - 2.0, 0.0) - 6.0 * np.maximum(TIMES - 2.5, 0.0)  # velocities jump
    assert encoder_jumps(stream(MOTION)) == encoder_jumps(stream(MOTION + blow)) == []
    glitch = MOTION.copy()
    glitch[700] += 0.5
    assert encoder_jumps(stream(glitch)) == []
    hole = stream(MOTION)
    assert encoder_jumps(hole.take((hole.times < 1.9) | (hole.times > 2.0))) == []
    assert encoder_jumps(stream(MOTION[(np.arange(len(MOTION)) // 10) * 10])) == []  # a slower sensor, repeated
    often = MOTION + 0.05 * np.floor(TIMES)
    assert encoder_jumps(stream(often)) == []  # a step of something else


def test_a_simulated_link_that_slips_is_named_before_anything_is_computed():
    pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
    from jointscope.tools.simulator import simulate

    effects = ["encoder_jump@joint3.link:size=0.09,time=2.5"]
    recording = simulate(ARM, "calibration", 4.0, 2, effects=effects).recording
    (notice,) = [notice for notice in screen_all(recording, ARM) if notice.kind == "jump"]
    assert notice.kind in PLAIN_MISTAKES
    (found,) = encoder_jumps(recording.streams["link_encoder"])
    assert found.channel == "joint3.link_position"
    assert found.time == pytest.approx(2.5, abs=0.002) and found.size == pytest.approx(0.09, abs=2.0 * STEP)
    assert f"joint3.link_position jumps by {found.size:+.3g} rad at {found.time:.3f} s and stays there" in notice.text
    assert "an event and no effect" in notice.text and "--leave-out simulation:2.49:4.0" in notice.text
    without = replace(recording, left_out=((2.49, 4.01),))
    assert [notice for notice in screen_all(without, ARM) if notice.kind == "jump"] == []
    clean = simulate(ARM, "calibration", 4.0, 2).recording
    assert [notice for notice in screen_all(clean, ARM) if notice.kind == "jump"] == []
