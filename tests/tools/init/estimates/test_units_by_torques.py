# SPDX-License-Identifier: BSD-3-Clause
"""Positions in turns, degrees or before a gear are told by the torques that moved an arm of MuJoCo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, divided, moved, written

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.units import si_factor
from jointscope.tools.init.estimates.position_units import position_units
from jointscope.tools.init.estimates.units_by_torques import unit_by_torques

ARM = Arm("yx", inertia=(0.5, 0.2), dry=(1.0, 0.4), viscous=(0.8, 0.3))
CONSTANTS = {"N m": (1.0, 1.0), "A": (7.0, 0.8)}


@pytest.fixture(scope="module")
def streams():
    return moved(ARM)


def found(folder, streams, factor, constants):
    tree = RigidTree(written(ARM, folder), ARM.joints, np.array(ARM.gravity))
    encoder, command = streams
    in_bag = replace(encoder, values=encoder.values / factor)
    return unit_by_torques(tree, in_bag, divided(command, constants), position_units(tree, in_bag, []))


@pytest.mark.parametrize("constants", CONSTANTS.values(), ids=CONSTANTS)
@pytest.mark.parametrize("unit", ["rad", "deg", "turn"])
def test_the_unit_in_which_the_masses_explain_the_commands(tmp_path, streams, unit, constants):
    guess = found(tmp_path, streams, si_factor(unit), constants)
    assert guess.units == (unit, unit) and not guess.scales


@pytest.mark.parametrize("constants", CONSTANTS.values(), ids=CONSTANTS)
@pytest.mark.parametrize("ratio", [50.0, 60.0, 100.0])
def test_a_gear_that_all_joints_have_is_no_degree(tmp_path, streams, ratio, constants):
    guess = found(tmp_path, streams, 1.0 / ratio, constants)
    assert guess.units == ("rad", "rad")
    assert guess.scales == pytest.approx((1.0 / ratio,) * 2, rel=1e-3)
    assert "gears of" in guess.reason


def test_a_command_that_nothing_explains_leaves_the_usual_unit(tmp_path, streams):
    encoder, command = streams
    noise = np.random.default_rng(5).standard_normal(command.values.shape)
    guess = found(tmp_path, (encoder, replace(command, values=noise)), 1.0, (1.0, 1.0))
    assert guess.units == ("rad", "rad") and not guess.scales
