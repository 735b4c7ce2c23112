# SPDX-License-Identifier: BSD-3-Clause
"""Poses of MuJoCo that are off by themselves: several of them do not hide each other, and none is made up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

COUNT, WRONG = 40, 6


@pytest.fixture(scope="module")
def tx90l():
    return load_robot("tx90l")


@pytest.mark.parametrize("together", [False, True], ids=["each its own way", "all the same way"])
@pytest.mark.parametrize("seed", [200, 202])
def test_all_poses_that_are_off_are_left_out_and_no_other(tx90l, seed, together):
    poses, rng = simulate_poses(tx90l, COUNT, seed)[0], np.random.default_rng(seed)
    wrong = np.sort(rng.choice(COUNT, WRONG, replace=False))
    away = rng.normal(size=(1 if together else WRONG, 3))
    target = poses.target.copy()
    target[wrong] += 2e-3 * away / np.linalg.norm(away, axis=1)[:, None]
    result = calibrate_poses(tx90l, [replace(poses, target=target)])
    assert sorted(int(each.name) for each in result.left_out) == wrong.tolist()
    assert 0.7 < result.repeatability < 1.4


@pytest.mark.parametrize("seed", [103, 113])
def test_poses_that_fit_stay(tx90l, seed):
    assert not calibrate_poses(tx90l, [simulate_poses(tx90l, COUNT, seed)[0]]).left_out


def test_an_effect_that_is_missing_is_no_crowd_of_outliers(tx90l):
    conditions = PoseConditions(effects=["encoder_eccentricity@joint2:cos=2e-3"])
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 60, 3, conditions)[0]])
    assert len(result.left_out) < 4 and result.repeatability > 10.0
