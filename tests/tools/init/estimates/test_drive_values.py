# SPDX-License-Identifier: BSD-3-Clause
"""What is concluded from the regression: gravity, starts above zero, what is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, moved, written

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.tools.init.estimates.drive_values import find_drives


def test_gravity_points_where_the_torques_need_it(tmp_path):
    arm = Arm("yx", inertia=(0.7, 0.2), dry=(2.0, 0.8), viscous=(1.5, 0.6), gravity=(0.0, 9.81, 0.0))
    encoder, command = moved(arm)
    tree = RigidTree(written(arm, tmp_path), arm.joints, np.array([0.0, 0.0, -9.81]))
    drives = find_drives(tree, encoder, command, np.full(2, 1e-5))
    np.testing.assert_allclose(drives.gravity, arm.gravity)
    assert "mounted on a wall" in drives.gravity_reason and drives.unit[0] == "N m"
    for j, drive in enumerate(drives.joints):
        assert drive.start["dry"] == pytest.approx(arm.dry[j], rel=0.02)
        assert drive.start["inertia"] == pytest.approx(arm.inertia[j], rel=0.02)


def test_gravity_stays_as_it_is_where_no_direction_explains_the_torques(tmp_path):
    arm = Arm("yx", inertia=(0.7, 0.2), dry=(2.0, 0.8), viscous=(1.5, 0.6))
    encoder, command = moved(arm)
    tree = RigidTree(written(arm, tmp_path), arm.joints, np.array([0.0, 0.0, -9.81]))
    noise = np.random.default_rng(0).normal(size=command.values.shape) * 60.0
    shaken = replace(command, values=np.cumsum(noise, axis=0) / 5.0)
    drives = find_drives(tree, encoder, shaken, np.full(2, 1e-5))
    assert drives.gravity_reason == "" and drives.gravity[2] == -9.81
    assert all(drive.explained < 0.9 for drive in drives.joints)


def test_values_that_are_lost_get_small_starts_and_say_so(tmp_path):
    arm = Arm("yx", inertia=(0.7, 0.2), dry=(2.0, 0.0), viscous=(0.0, 0.6))
    tree = RigidTree(written(arm, tmp_path), arm.joints, np.array(arm.gravity))
    encoder, command = moved(arm, counts=4096)
    first, second = find_drives(tree, encoder, command, np.full(2, 4.4e-4)).joints
    assert first.is_lost("viscous") and second.is_lost("dry")
    assert not first.is_lost("dry") and not second.is_lost("viscous")
    assert 0.0 < second.start["dry"] < 0.3 and 0.0 < first.start["viscous"] < 1.0


def test_a_constant_that_nothing_tells_is_like_that_of_the_next_joint(tmp_path):
    """Rotor and friction of a wrist hide its masses; a rotor as heavy as these would be a hundred times too light."""
    arm = Arm("yz", inertia=(0.7, 1.0), dry=(2.0, 8.0), viscous=(1.5, 9.0))
    tree = RigidTree(written(arm, tmp_path), arm.joints, np.array(arm.gravity))
    encoder, command = moved(arm, counts=1024)
    currents = replace(command, values=command.values / np.array([8.0, 5.0]))
    first, second = find_drives(tree, encoder, currents, np.full(2, 1.8e-3), unit="A").joints
    assert not first.unknown_scale and first.start["gain"] == pytest.approx(8.0, rel=0.02)
    assert second.unknown_scale and second.start["gain"] == first.start["gain"]
    assert second.start["inertia"] / second.start["gain"] == pytest.approx(1.0 / 5.0, rel=0.05)
    assert second.start["dry"] / second.start["gain"] == pytest.approx(8.0 / 5.0, rel=0.05)
