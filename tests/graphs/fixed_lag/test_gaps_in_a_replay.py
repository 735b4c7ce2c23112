# SPDX-License-Identifier: BSD-3-Clause
"""Robots with gaps, in a drive or in a sensor: the estimator ends up where the batch smoother does."""

from __future__ import annotations

import pytest

import jointscope as js
from jointscope.graphs.fixed_lag.replay.batch_agreement import batch_agreement
from jointscope.graphs.fixed_lag.replay.replay import replay
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
pytestmark = pytest.mark.slow


# where a joint stands within the play a tick or two may be far: of 3 s these alone would be more than a hundredth
BEGIN = 0.6  # [s] by when the robot moves
FAULTS = [("backlash@joint1:half_gap=0.01", 3.0), ("encoder_hysteresis@joint2:half_play=4e-4", 6.0)]


@pytest.mark.parametrize(("fault", "seconds"), FAULTS)
def test_states_at_the_lag_agree_with_the_batch_from_a_rest_within_the_gap(fault, seconds):
    doggy = load_robot("doggy")
    train, moves = (
        js.simulate("doggy", motion=motion, seconds=length, seed=5, effects=[fault]).recording
        for motion, length in (("calibration", 6.0), ("moves", seconds))
    )
    robot = js.calibrate(add_effect(doggy, fault.split(":")[0]), train).robot
    lagged = replay(robot, moves, 0.1).lagged
    moving = lagged.times > BEGIN
    found = batch_agreement(robot, moves, lagged.times[moving], lagged.mean[moving], lagged.sigma[moving])
    assert found.apart == {} and found.agrees
