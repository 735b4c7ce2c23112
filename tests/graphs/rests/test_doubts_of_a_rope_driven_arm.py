# SPDX-License-Identifier: BSD-3-Clause
"""What is a little off on a bench with weights, of recordings that no code of ours made, is named; nothing else is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_rests import read_rests
from jointscope.tools.verdicts.rests.rest_verdict import verdict

DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "biorob"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not DATA.is_dir(), reason="shared/data/biorob is not beside the project"),
]
ROBOT = load_robot("biorob")


@pytest.fixture(scope="module")
def bench():
    """Rests of four springs and of gravity."""
    bags = [*(f"static_spring/spring{k}" for k in (1, 2, 3, 4)), "static_gravity/gravity"]
    return [read_rests(DATA / bag, ROBOT) for bag in bags]


def test_a_bench_without_mistakes_is_a_yes_that_says_how_far_all_weights_may_be_off(bench):
    result = calibrate_rests(ROBOT, bench)
    together = {u.label: u.share for u in result.unnoticed}["weights@robot"]
    assert not result.doubts and 0.003 < together < 0.05
    assert verdict(result).startswith("Yes, the model holds at these rests, as far as they tell. Springs and friction")


@pytest.mark.parametrize("share", (0.99, 1.01, 1.02))
def test_loads_a_percent_off_are_named_with_their_size(bench, share):
    result = calibrate_rests(ROBOT, [replace(rests, forces=share * rests.forces) for rests in bench])
    first = result.doubts[0]
    assert first.label == "load_scale@robot" and first.fall > 100.0
    assert 1.0 + first.size == pytest.approx(1.0 / share, abs=0.002)
    assert verdict(result).startswith("No, do not rely on this yet: these rests are far likelier")


def test_the_zero_of_a_motor_encoder_two_milliradians_off_is_named(bench):
    off = np.array([0.0, 0.002, 0.0, 0.0])
    result = calibrate_rests(ROBOT, [replace(rests, q_motor=rests.q_motor + off) for rests in bench])
    labels = [doubt.label for doubt in result.doubts[:2]]
    assert "encoder_offset@joint2" in labels and result.doubts[0].fall > 60.0
    assert "the zero of joint2" in verdict(result)
