# SPDX-License-Identifier: BSD-3-Clause
"""Orientations of targets, by an arm in MuJoCo: right values and noises, what they add, and wrong conventions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tools_with_targets import tool_with

from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.tip_errors import summary
from jointscope.graphs.poses.tracker_start import placed
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.rotations import of_quaternions, quaternion_xyzw, rotation_vectors
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
TOLD = ("joint1.mis_y", "joint1.mis_x", "joint2.mis_x", "joint3.mis_x", "joint3.lz", "joint4.mis_x", "joint5.mis_x")
WRIST = ("joint4.mis_x", "joint5.mis_x", "joint6.mis_x")


@pytest.fixture(scope="module")
def tx90l():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def simulated(tx90l):
    return simulate_poses(tx90l, 30, 3, PoseConditions(orientation=True))


@pytest.fixture(scope="module")
def result(tx90l, simulated):
    return calibrate_poses(tx90l, [simulated[0]])


def test_the_orientation_on_the_tool_is_found_from_nothing(result, simulated):
    """What the tracker shows of poses that the estimate does not know: the tool's own turn, from MuJoCo."""
    R = np.array(pin.Quaternion(np.array(simulated[1]["orientations_xyzw"]["reflector"])).toRotationMatrix())
    off = rotation_vectors((R.T @ result.robot.poses.turn)[None])
    assert (
        result.robot.poses.turn is not None and np.linalg.norm(off) < 5e-3
    )  # what errors of all joints can make of it
    assert summary(result.errors).to_json()["rms_mrad"] < 0.25


def test_poses_that_were_not_fitted_are_met_in_milliradians(result, tx90l):
    others, _ = simulate_poses(tx90l, 60, 3, PoseConditions(orientation=True), "others")
    _, (problem,) = placed(result.robot, [others])
    _, calibration = problem.start(result.calibrations[0])
    point = problem.point(calibration)
    J, r = problem.columns(point, calibration), problem.misses(point, calibration)
    told = problem.covariances(point) + J @ result.covariance @ np.swapaxes(J, 1, 2)
    squares = np.einsum("mi,mi->m", r, np.linalg.solve(told, r[:, :, None])[:, :, 0])
    assert 0.85 < squares.mean() / 6.0 < 1.15


def test_orientation_tells_more_of_the_wrist(result, tx90l, simulated):
    without = calibrate_poses(tx90l, [replace(simulated[0], turn=None)])
    for name in WRIST:
        assert result.robot.parameters[name].sigma < 0.9 * without.robot.parameters[name].sigma


def test_sigmas_and_both_noises_are_honest_in_twenty_arms(tmp_path):
    """The file says 0.5 mrad of orientations and 20 urad of joints; the truth is 0.2 mrad and 20 urad."""
    truth_of_noise = tool_with(tmp_path / "true", "", "  orientation_sigma: 2.0e-4\n")
    robot = tool_with(tmp_path / "file", "", "  orientation_sigma: 5.0e-4\n")
    z, turns, repeats = [], [], []
    for seed in range(20):
        poses, truth = simulate_poses(truth_of_noise, 25, seed, PoseConditions(orientation=True))
        found = calibrate_poses(robot, [poses])
        turns.append(found.robot.poses.turn_sigma)
        repeats.append(np.median(found.robot.poses.joint_sigmas))
        for name in TOLD:
            p = found.robot.parameters[name]
            z.append((p.value - truth["parameters"][name]) / p.sigma)
    assert 0.85 < np.sqrt(np.mean(np.square(z))) < 1.15 and np.mean(np.abs(z) < 2.0) > 0.91
    assert np.mean(turns) == pytest.approx(2e-4, rel=0.05) and np.std(turns) < 0.2 * np.mean(turns)
    assert np.mean(repeats) == pytest.approx(2e-5, rel=0.1)


def test_the_noise_of_orientations_stays_as_the_file_says_where_it_shall(tmp_path, simulated):
    robot = tool_with(tmp_path, "", "  orientation_sigma: 5.0e-4\n  estimate_orientation_sigma: false\n")
    assert calibrate_poses(robot, [simulated[0]]).robot.poses.turn_sigma == 5e-4


def test_a_known_orientation_says_more_and_a_wrong_one_is_told(tmp_path, tx90l, simulated):
    poses, truth = simulated
    x, y, z, w = truth["orientations_xyzw"]["reflector"]
    known = tool_with(tmp_path / "known", "", f"  orientation: [{x:.9f}, {y:.9f}, {z:.9f}, {w:.9f}]\n")
    found = calibrate_poses(known, [poses]).robot.parameters
    open_one = calibrate_poses(tx90l, [poses]).robot.parameters
    assert found["tool.mis_y"].sigma < open_one["tool.mis_y"].prior_sigma
    assert abs(found["tool.mis_y"].value - truth["parameters"]["tool.mis_y"]) < 3.0 * found["tool.mis_y"].sigma
    wrong = tool_with(tmp_path / "wrong", "", "  orientation: [0.0, 0.0, 0.0, 1.0]\n")
    with pytest.raises(
        RecordingError, match=r"reflector is not oriented on the tool as tool.yaml says, off by .*leave"
    ):
        calibrate_poses(wrong, [poses])


def turned(poses, make):
    return replace(poses, turn=np.array([make(R) for R in poses.turn]))


MIRROR = np.diag([1.0, -1.0, 1.0])
CONVENTIONS = {
    "in the order w, x, y, z they fit": lambda R: of_quaternions(np.roll(quaternion_xyzw(R), 1)[None])[0],
    "their inverses fit, as of the tracker in the axes of the target": lambda R: R.T,
    "their inverses in the order w, x, y, z": lambda R: of_quaternions(np.roll(quaternion_xyzw(R.T), 1)[None])[0],
    "axes with y the other way, as of a left-handed tracker": lambda R: MIRROR @ R @ MIRROR,
    "turned by roll 0, pitch 0, yaw 30 degrees": lambda R: pin.rpy.rpyToMatrix(0.0, 0.0, np.pi / 6.0) @ R,
    "no other convention fits": lambda R: R @ R,
}


@pytest.mark.parametrize("told", CONVENTIONS)
def test_wrong_conventions_are_named_in_one_line(tx90l, simulated, told):
    with pytest.raises(RecordingError) as err:
        calibrate_poses(tx90l, [turned(simulated[0], CONVENTIONS[told])])
    assert told in str(err.value) and "\n" not in str(err.value)
    assert str(err.value).startswith("simulation: the orientations of reflector are off by")


def test_an_orientation_that_is_off_takes_its_pose_with_it(tx90l, simulated):
    turn = simulated[0].turn.copy()
    turn[5] = pin.exp3(np.array([0.0, 4e-3, 0.0])) @ turn[5]
    found = calibrate_poses(tx90l, [replace(simulated[0], turn=turn)])
    assert [each.name for each in found.left_out] == ["5"]


def test_orientations_that_are_wrong_in_some_poses_are_told_with_these_poses(tx90l, simulated):
    turn = simulated[0].turn.copy()
    turn[[4, 8, 21]] = turn[[4, 8, 21]] @ np.diag([-1.0, -1.0, 1.0])
    with pytest.raises(RecordingError, match=r"orientation of reflector is off by .* in pose 4, 8, 21 and fits in the"):
        calibrate_poses(tx90l, [replace(simulated[0], turn=turn)])


def test_sessions_with_and_without_orientation_go_together(tx90l, simulated):
    other = simulate_poses(tx90l, 20, 3, session="others")[0]
    found = calibrate_poses(tx90l, [simulated[0], other])
    assert [problem.measured for problem in found.problems] == [180, 60]
    assert len(summary(found.errors).turns) == 30
