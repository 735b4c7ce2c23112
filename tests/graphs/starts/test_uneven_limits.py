# SPDX-License-Identifier: BSD-3-Clause
"""Limits of drives that depend on the direction or fall with speed are found; nothing is said of any other drive."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_arm import Arm, moved, written

from jointscope.graphs.starts.command_limits import windows_of_drives
from jointscope.graphs.starts.drive_regression import Driven
from jointscope.graphs.starts.uneven_limits import uneven_limit
from jointscope.robots.bodies.rigid_tree import RigidTree

ARM = Arm()
WIDTH = 0.12
JOINT = 1


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    return RigidTree(written(ARM, tmp_path_factory.mktemp("arm")), ARM.joints, np.array(ARM.gravity))


@pytest.fixture(scope="module")
def largest():
    u = moved(ARM)[1].values[:, JOINT]
    return float(np.quantile(u, 0.98)), float(np.quantile(-u, 0.98))


def limits_of(tree, **how):
    windows = windows_of_drives(tree, [Driven(*moved(ARM, **how))], np.full(3, 1e-5))[WIDTH]
    return [uneven_limit(windows, joint) for joint in range(3)]


def only_one(joint, low, high):
    """A drive that gives commands between two functions of the speed."""

    def drive(_, u, __, data):
        v, given = data.qvel[joint], u.copy()
        given[joint] = np.clip(u[joint], low(v), high(v))
        return given

    return drive


def test_levels_that_differ_between_directions_are_found_where_they_are(tree, largest):
    upper, lower = 0.55 * largest[0], 0.85 * largest[1]
    first, found, third = limits_of(tree, drive=only_one(JOINT, lambda _: -lower, lambda _: upper))
    assert first is None and third is None
    assert found.upper == pytest.approx(upper, rel=0.05) and found.lower == pytest.approx(lower, rel=0.1)
    assert found.falls < 0.1
    _, command = moved(ARM, drive=only_one(JOINT, lambda _: -lower, lambda _: upper))
    u = command.values[:, JOINT]
    assert found.share == pytest.approx(np.mean((u > upper) | (u < -lower)), abs=0.02)
    assert all(a < b for a, b in found.beyond[0])


def test_a_limit_that_a_back_emf_lowers_with_speed_is_found(tree, largest):
    level, slope = 0.9 * max(largest), 1.5
    drive = only_one(JOINT, lambda v: -level - slope * v, lambda v: level - slope * v)
    first, found, third = limits_of(tree, drive=drive)
    assert first is None and third is None
    assert found.slope == pytest.approx(slope, rel=0.4) and found.falls > 0.2
    assert max(found.upper, found.lower) == pytest.approx(level, rel=0.2)


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"seed": 4},
        {"sticks": True},
        {"push": (2.0, 3.0, 1, 15.0)},
        {"cable": 8.0},
        {"noise": 3e-4, "encoder_rate": 500.0},
        {"encoder_rate": 50.0, "command_rate": 200.0},
    ],
    ids=str,
)
def test_nothing_is_said_of_drives_that_give_what_is_commanded(tree, how):
    assert limits_of(tree, **how) == [None, None, None]


@pytest.mark.parametrize("share", [0.5, 0.75, 0.92])
def test_one_level_for_both_directions_is_no_uneven_limit(tree, share):
    most = tuple(share * np.abs(moved(ARM, seed=2)[1].values).max(axis=0))
    assert limits_of(tree, most=most, seed=2) == [None, None, None]
