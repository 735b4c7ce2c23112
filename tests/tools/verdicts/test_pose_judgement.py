# SPDX-License-Identifier: BSD-3-Clause
"""The answer about poses that MuJoCo made or a real arm: what leaves small residuals but is wrong is said."""

from __future__ import annotations

from dataclasses import replace

import pytest
from measured_poses import PANDA

from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.untold_distances import untold_distance
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses
from jointscope.tools.verdicts.pose_judgement import judge_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")


@pytest.fixture(scope="module")
def tx90l():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def panda():
    return load_robot("panda")


def check_of(result, name):
    return next(check for check in judge_poses(result).checks if check.name.startswith(name))


@pytest.mark.parametrize("seed", [100, 101])
def test_a_clean_arm_lacks_nothing(tx90l, seed):
    assert judge_poses(calibrate_poses(tx90l, [simulate_poses(tx90l, 60, seed)[0]])).level == "good"


def test_a_payload_that_hides_in_the_repeatability_is_no_yes(tx90l):
    conditions = PoseConditions(effects=["payload@robot:mass=1"])
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 60, 3, conditions)[0]])
    check = check_of(result, "An effect that is missing")
    assert result.repeatability < 3.0 and check_of(result, "Residuals as the arm repeats").level == "good"
    assert judge_poses(result).level == "warn"
    assert check.text.startswith("What is left looks like payload@robot, about 0.9") and "diagnose" in check.text


@pytest.mark.skipif(not PANDA.is_dir(), reason="shared/data/real/panda_sockets is not beside the project")
@pytest.mark.parametrize(("said", "level"), [(0.05, "good"), (0.055, "bad")])
def test_real_sockets_that_are_said_to_be_further_apart_than_they_are_stretch_no_arm_unseen(panda, said, level):
    robot = replace(panda, poses=replace(panda.poses, contact_distance=said))
    result = calibrate_poses(robot, [read_poses(PANDA / "panda_1.csv", robot)])
    found = untold_distance(result)
    assert abs(found.found - 0.05) < 2.0 * found.sigma < 1e-3
    check = check_of(result, "Contacts as far apart")
    assert check.level == level
    assert ("sigma from the 55.00 mm that panda.yaml says" in check.text) is (level == "bad")


def test_nothing_is_said_of_distances_where_a_tracker_measures(tx90l):
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 40, 100)[0]])
    assert untold_distance(result) is None
    assert not any(check.name.startswith("Contacts") for check in judge_poses(result).checks)


def test_errors_of_a_size_that_no_geometry_has_are_a_no(tx90l):
    conditions = PoseConditions(values={"joint3.lz": 0.025})
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 60, 3, conditions)[0]])
    check = check_of(result, "Errors of a size")
    assert check.level == "bad" and "joint3.lz (25" in check.text and "contact_distance" not in check.text
