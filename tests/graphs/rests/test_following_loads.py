# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a rigid joint that holds what loads say speaks of loads that are wrong: no encoder contradicts it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from lever_bench import hanging, lever

from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.tools.verdicts.rests.rest_verdict import verdict


@pytest.mark.parametrize("factor", (-1.0, 0.5, 1.5))
def test_loads_of_another_sign_or_unit_are_no_yes(tmp_path, factor):
    rests = hanging(60, 3, rigid=True)
    said = verdict(calibrate_rests(lever(tmp_path, rigid=True), [replace(rests, forces=factor * rests.forces)]))
    assert said.startswith("No") and "what friction of swing has to hold goes with loads and gravity" in said


@pytest.mark.parametrize("count", (15, 60))
def test_true_loads_are_not_doubted(tmp_path, count):
    robot = lever(tmp_path, rigid=True)
    errors = [calibrate_rests(robot, [hanging(count, 900 + seed, rigid=True)]).errors for seed in range(20)]
    assert min(found.following(0)[1] for found in errors) > 1e-4  # 0.05 expected of twenty


def test_joints_with_springs_and_few_rests_are_not_asked(tmp_path):
    assert calibrate_rests(lever(tmp_path), [hanging(40, 1)]).errors.following(0) == (0.0, 1.0)
    few = calibrate_rests(lever(tmp_path, rigid=True), [hanging(9, 1, rigid=True)])
    assert few.errors.following(0) == (0.0, 1.0)
