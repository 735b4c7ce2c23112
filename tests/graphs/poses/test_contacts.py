# SPDX-License-Identifier: BSD-3-Clause
"""A ball in a socket instead of a tracker: made-up arms with known errors, and a real one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measured_poses import PANDA

from jointscope.factors.calibration import Calibration
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import contact_distances, tip_errors
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.poses import Poses
from jointscope.tools.bags.at_poses.read_poses import read_poses

DH = ((0, 0.333, 0), (0, 0, -90), (0, 0.316, 90), (0.0825, 0, 90), (-0.0825, 0.384, -90), (0, 0, 90), (0.088, 0, 90))


@pytest.fixture(scope="module")
def panda(tmp_path_factory):
    """A Panda by its maker's Denavit-Hartenberg numbers, without masses."""
    folder = tmp_path_factory.mktemp("panda")
    text = '<robot name="panda"><link name="base"/>'
    for i, (a, d, degrees) in enumerate(DH, start=1):
        alpha = np.deg2rad(degrees)
        x, y, z = a, -d * np.sin(alpha), d * np.cos(alpha)
        parent = "base" if i == 1 else f"link{i - 1}"
        text += (
            f'<link name="link{i}"/><joint name="joint{i}" type="revolute"><parent link="{parent}"/>'
            f'<child link="link{i}"/>'
            f'<origin xyz="{x} {y} {z}" rpy="{alpha} 0 0"/><axis xyz="0 0 1"/>'
            '<limit lower="-3.8" upper="3.8" effort="87" velocity="2"/></joint>'
        )
    text += (
        '<link name="flange"/><joint name="f" type="fixed"><parent link="link7"/><child link="flange"/>'
        '<origin xyz="0 0 0.107"/></joint></robot>'
    )
    (folder / "panda.urdf").write_text(text)
    joints = ", ".join(f"joint{i}" for i in range(1, 8))
    (folder / "panda.yaml").write_text(
        f"format: 1\nname: panda\nurdf: panda.urdf\ngravity: [0.0, 0.0, -9.81]\njoints: [{joints}]\n"
        "poses: {target: flange, sigma: 1.0e-4, repeatability: 1.0e-4, length_sigma: 3.0e-3, angle_sigma: 1.0e-2,\n"
        "  tool_sigma: 0.15, contact_distance: 0.05}\n"
    )
    return load_robot(folder / "panda.yaml")


def around_sockets(robot, rng):
    """Poses of an arm with errors, each by iteration on the angles until its ball is in a socket."""
    arm = PoseSet(robot, Poses("", "", (), np.zeros((0, 7)), None), np.eye(4)).arm
    values = {name: p.value for name, p in robot.parameters.items()}
    sockets = {f"{p}/{s}": (np.array(at) + 0.05 * s * np.eye(3)[0], p) for p, at in PLACES.items() for s in (0, 1)}
    q, contacts = [], []
    for contact, (point, _) in sockets.items():
        angles = rng.uniform([-2, -1, -2, -2.4, -2, 0.5, -2], [2, 1, 2, -1, 2, 3, 2], (60, 7))
        for _ in range(60):
            here = arm.at(angles, np.zeros_like(angles), values)
            angles = angles - (np.linalg.pinv(here.by_joint) @ (here.target - point)[:, :, None])[:, :, 0]
        there = np.all(np.abs(angles) < 2.8, axis=1) & (np.linalg.norm(here.target - point, axis=1) < 1e-9)
        q += list(angles[there][:12])
        contacts += [contact] * 12
    places = tuple((contact, place) for contact, (_, place) in sockets.items())
    q = np.array(q) - 5e-5 * rng.standard_normal((len(q), 7))
    return Poses("made", "", tuple(map(str, range(len(q)))), q, None, tuple(contacts), places)


PLACES = {"left": (0.4, 0.3, 0.2), "right": (0.45, -0.3, 0.1), "high": (0.3, 0.1, 0.6), "far": (0.6, 0.0, 0.3)}


@pytest.mark.slow
def test_an_arm_is_calibrated_without_any_tracker(panda):
    rng = np.random.default_rng(5)
    errors = {n: p.prior_sigma * 0.3 * rng.standard_normal() for n, p in panda.parameters.items() if n[0] == "j"}
    truth = panda.with_values(errors | {"tool.lx": 0.02, "tool.ly": -0.03, "tool.lz": 0.08})
    poses = around_sockets(truth, rng)
    held = np.array([place == "far" for place in poses.groups])
    before = tip_errors(PoseSet(panda, poses.only(held), np.eye(4))).to_json()["mean_mm"]
    result = calibrate_poses(panda, [poses.only(~held)])
    after = tip_errors(PoseSet(result.robot, poses.only(held), np.eye(4))).to_json()["mean_mm"]
    floor = tip_errors(PoseSet(truth, poses.only(held), np.eye(4))).to_json()["mean_mm"]
    assert before > 5.0
    assert after < 2.5 * floor < 0.2
    assert result.robot.parameters["tool.lz"].value == pytest.approx(
        0.08, abs=4 * result.robot.parameters["tool.lz"].sigma
    )


@pytest.mark.skipif(not PANDA.is_dir(), reason="shared/data/real/panda_sockets is not beside the project")
def test_a_real_arm_comes_from_eight_millimetres_to_less_than_one_at_places_it_has_not_seen(panda):
    poses = read_poses(PANDA / "panda_1.csv", panda)
    held = np.array([place == "right" for place in poses.groups])
    result = calibrate_poses(panda, [poses.only(~held)])
    problem = PoseSet(result.robot, poses.only(held), np.eye(4))
    assert tip_errors(problem).to_json()["mean_mm"] < 0.8
    _, calibration = problem.start(Calibration.of(result.robot))
    assert contact_distances(problem, calibration)["right"] == pytest.approx(0.05, abs=4e-4)


def test_sockets_hold_more_than_one_unknown_each_or_it_is_told(panda):
    poses = Poses("few", "", tuple("abcdefgh"), np.zeros((8, 7)) + np.arange(8)[:, None] * 0.1, None, tuple("abcdefgh"))
    with pytest.raises(Exception, match="8 poses at 8 contacts tell 0 coordinates"):
        calibrate_poses(panda, [replace(poses, places=tuple((c, c) for c in "abcdefgh"))])
