# SPDX-License-Identifier: BSD-3-Clause
"""What a motion does not tell of a target is held, as many parameters as there are open directions, and no more."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_arm import Arm, robot_file

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Topic
from jointscope.tools.init.estimates.open_target import held_parameters

PRIORS = np.repeat([0.1, 0.1, 0.2], 3)
SIGMA = 3e-4  # [m]


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    return load_robot(robot_file(Arm("yxy"), tmp_path_factory.mktemp("arm"))).tree


def target_on(link):
    T = np.eye(4)
    T[:3, :3], _ = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))
    T[:3, :3] *= np.linalg.det(T[:3, :3])
    T[:3, 3] = [1.2, -0.4, 0.6]
    source = Topic("/trk", "geometry_msgs/msg/PointStamped", "point", "m")
    return PositionTarget("trk", source, link, np.array([0.2, 0.1, 0.3]), None, T, "trk", SIGMA)


def motion(moving, seed=0):
    return 0.6 * np.random.default_rng(seed).standard_normal((200, 3)) * np.isin(range(3), moving)


def test_nothing_is_held_where_all_joints_move(tree):
    assert held_parameters(tree, target_on("of_j2"), motion([0, 1, 2]), SIGMA, PRIORS) == ()


def test_about_one_axis_two_directions_are_open(tree):
    held = held_parameters(tree, target_on("of_j0"), motion([0]), SIGMA, PRIORS)
    assert len(held) == 2 and "trk.offset_y" in held  # along the axis, and a turn about it


def test_in_a_plane_the_target_across_it_is_open(tree):
    assert held_parameters(tree, target_on("of_j1"), motion([0, 1]), SIGMA, PRIORS) == ()
    assert len(held_parameters(tree, target_on("of_j2"), motion([1]), SIGMA, PRIORS)) == 2


def test_where_nothing_moves_six_of_nine_are_open(tree):
    assert len(held_parameters(tree, target_on("of_j2"), motion([]), SIGMA, PRIORS)) == 6
