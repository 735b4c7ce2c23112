# SPDX-License-Identifier: BSD-3-Clause
"""The zero of an encoder that moves during a session, on arms that MuJoCo poses and on a real one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measured_poses import PANDA

from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.linear_poses import LinearPoses
from jointscope.graphs.poses.screen_contacts import moved_contacts
from jointscope.graphs.poses.what_moved import what_moved, with_ends
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses
from jointscope.tools.verdicts.pose_judgement import judge_poses, moved_during

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")


@pytest.fixture(scope="module")
def robot():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def poses(robot):
    return simulate_poses(robot, 80, 3)[0]


def found_in(robot, poses):
    result = calibrate_poses(robot, [poses])
    problems = with_ends(result.problems, result.whole)
    linear = LinearPoses.at(result.robot, problems, result.calibrations)
    return result, what_moved(linear, problems, result.calibrations)


def jumped(poses, joint, size, start):
    """The joint reads more from a pose on than it stands."""
    q = poses.q.copy()
    q[start:, joint - 1] += size
    return replace(poses, q=q)


@pytest.mark.parametrize(("joint", "size", "start"), [(1, 3e-4, 40), (3, 1.7e-3, 41), (4, -1.7e-3, 30), (5, -3e-4, 40)])
def test_a_joint_whose_zero_jumps_half_way_is_named_with_pose_size_and_sign(robot, poses, joint, size, start):
    result, step = found_in(robot, jumped(poses, joint, size, start))
    assert (step.joint, step.before, step.after) == (f"joint{joint}", str(start - 1), str(start))
    assert abs(step.size - size) < 0.1 * abs(size)
    assert judge_poses(result).level == "bad"


def test_poses_behind_a_jump_that_are_all_left_out_are_no_outliers_but_a_jump(robot, poses):
    result, step = found_in(robot, jumped(poses, 3, 1.7e-3, 72))
    assert len(result.left_out) == 8
    assert step.text.startswith("From pose 72 of simulation on joint3 reads 1.7 mrad more: its coupling slipped")
    result, step = found_in(robot, replace(jumped(poses, 2, -1e-3, 0), q=jumped(poses, 2, 1e-3, 7).q))
    assert (step.joint, step.after) == ("joint2", "7") and len(result.left_out) == 7


def in_two(poses):
    first, second = (poses.only(each < 40) for each in (np.arange(80), 79 - np.arange(80)))
    return [replace(first, path="first.csv"), replace(second, path="second.csv")]


def test_a_zero_that_moved_between_two_sessions_is_named_with_the_session(robot, poses):
    for size in (0.0, 1.2e-3):
        result = calibrate_poses(robot, in_two(jumped(poses, 3, size, 40)))
        step = moved_during(result)
        if not size:
            assert step is None
            continue
        assert (step.joint, step.before) == ("joint3", "") and "than in the other sessions" in step.text
        sign = 1.0 if step.path == "second.csv" else -1.0
        assert abs(sign * step.size - size) < 0.1 * size


def test_a_pose_or_two_that_fit_nothing_are_no_jump(robot, poses):
    q = poses.q.copy()
    q[[30, 78], 2] += 2e-3
    result, step = found_in(robot, replace(poses, q=q))
    assert [each.name for each in result.left_out] == ["30", "78"] and step is None


@pytest.mark.parametrize("effect", ["tracker_drift@robot:x=2e-4", "payload@robot:mass=4", "backlash@joint5"])
def test_what_changes_by_and_by_or_with_the_posture_is_no_jump(robot, effect):
    assert found_in(robot, simulate_poses(robot, 60, 26, PoseConditions(effects=(effect,)))[0])[1] is None


@pytest.mark.skipif(not PANDA.is_dir(), reason="shared/data/real/panda_sockets is not beside the project")
def test_a_jump_is_found_with_a_ball_in_sockets_and_what_guiding_by_hand_leaves_is_none():
    panda = load_robot("panda")
    poses = read_poses(PANDA / "panda_1.csv", panda)
    assert found_in(panda, poses)[1] is None
    step = found_in(panda, jumped(poses, 4, 4e-3, 100))[1]
    assert step.joint == "panda_joint4" and int(step.before) < 100 <= int(step.after)
    assert step.size == pytest.approx(4e-3, abs=1e-3)


@pytest.mark.skipif(not PANDA.is_dir(), reason="shared/data/real/panda_sockets is not beside the project")
def test_a_plate_that_moved_for_some_poses_is_told_with_them():
    """A socket that is elsewhere is the same as targets that are: the joints turn to where it is."""
    panda = load_robot("panda")
    poses = read_poses(PANDA / "panda_1.csv", panda)
    held = calibrate_poses(panda, [poses])
    session = replace(held.problems[0], poses=poses)
    J = session.point(held.calibrations[0]).by_joint
    q = poses.q.copy()
    q[70:78] += np.einsum("mij,mik,k->mj", J, np.linalg.inv(J @ np.swapaxes(J, 1, 2)), [0.0, 4e-3, 3e-3])[70:78]
    result = calibrate_poses(panda, [replace(poses, q=q)])
    (moved,) = moved_contacts(result.problems, result.whole, result.calibrations)
    assert (moved.first, moved.last, moved.contact) == ("70", "77", "front/socket0")
    assert moved.size == pytest.approx(5e-3, abs=5e-4)
    assert moved_contacts(held.problems, held.whole, held.calibrations) == []
    said = " ".join(check.text for check in judge_poses(result).checks)
    assert "some are off together in one direction: 70 to 77 by" in said
