# SPDX-License-Identifier: BSD-3-Clause
"""Rests in one estimate with motion are asked as rests alone are, and have the same posterior.

The motion is MuJoCo's, equilibria are worked out by hand (lever_bench.py).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, hanging, lever

from jointscope import calibrate, simulate
from jointscope.graphs.rests import rests_beside_motion as beside
from jointscope.graphs.rests.calibrate_rests import calibrate_rests, settled_rests
from jointscope.graphs.rests.rests_beside_motion import seen_rests
from jointscope.tools.verdicts.judgement import judge


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    """The rigid lever, and eight seconds of it."""
    robot = lever(tmp_path_factory.mktemp("rod"), rigid=True)
    true = robot.with_values({"swing.coulomb_torque": C0})
    return robot, simulate(true, seconds=8.0, seed=3).recording


def with_motion(rod, rests):
    robot, motion = rod
    weighed, *_ = settled_rests(robot, [rests], lambda text, share: None)
    return calibrate(robot, motion, sets=weighed)


def friction_of(result):
    return next(p for p in result.parameters if p.name == "swing.coulomb_torque")


def test_true_rests_stand_beside_motion_with_a_yes(rod):
    result = with_motion(rod, hanging(40, 3, rigid=True))
    judged = judge(result)
    assert judged.level == "good", judged.answer
    (check,) = (check for check in judged.checks if check.name == "Rests that agree with the model")
    assert check.level == "good" and not seen_rests(result).doubts
    found = friction_of(result)
    assert abs(found.value - C0) < 3.0 * found.sigma
    assert found.sigma < 0.2 * friction_of(calibrate_rests(rod[0], [hanging(40, 3, rigid=True)])).sigma


@pytest.mark.parametrize("load", (0.9, 1.05))
def test_loads_that_are_wrong_are_no_yes(rod, load):
    rests = hanging(40, 3, rigid=True)
    result = with_motion(rod, replace(rests, forces=load * rests.forces))
    (check,) = (check for check in judge(result).checks if check.name == "Rests that agree with the model")
    assert judge(result).level == check.level == "bad" and seen_rests(result).doubts[0].p_value < 1e-6


def test_joints_that_stood_at_all_rests_are_told_beside_motion(rod):
    rests = hanging(40, 3, rigid=True)
    result = with_motion(rod, replace(rests, moved=np.zeros((40, 1), dtype=bool)))
    (check,) = (check for check in judge(result).checks if check.name == "Rests that tell what they might")
    assert check.level == "info" and "swing never moved before any of these 40 rests" in check.text


def test_without_rests_nothing_is_said_of_them(rod):
    result = calibrate(*rod)
    assert seen_rests(result) is None and not any("Rests" in check.name for check in judge(result).checks)


def test_steps_that_are_tried_and_fail_warn_nobody(rod, monkeypatch):
    said = []
    monkeypatch.setattr(beside, "settled_rests", lambda *args: [said.append(np.geterr())])
    beside.weighted_rests(rod[0], [rod[1]], [hanging(10, 3, rigid=True)], lambda text, share: None)
    assert set(said[0].values()) == {"ignore"}
