# SPDX-License-Identifier: BSD-3-Clause
"""Loads of another size than said are named as such, and not blamed on the arm; equilibria are worked out by hand."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, hanging, lever

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_search.discover_rests import diagnose_rests, discover_rests
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.robots.files.effect_editing import add_effect
from jointscope.tools.terminal.searches.rest_search_text import headline

SCALE = "load_scale@robot"


@pytest.mark.parametrize("rigid", (False, True))
@pytest.mark.parametrize("said", (1.25, 0.8))
def test_loads_of_another_size_are_found_with_it(tmp_path, rigid, said):
    rests = hanging(60, 3, rigid=rigid)
    found = discover_rests(lever(tmp_path, rigid=rigid), [replace(rests, forces=said * rests.forces)])
    assert [step.added.label for step in found.steps[1:]] == [SCALE]
    share = found.robot.parameters["robot.load_scale.share"].value
    assert 1.0 + share == pytest.approx(1.0 / said, rel=0.02)
    assert found.robot.parameters["swing.coulomb_torque"].value == pytest.approx(C0, rel=0.15)
    first = headline(replace(found, steps=found.steps[:1]))
    told = re.fullmatch(rf"Missing: {SCALE}\. The loads are ([\d.]+) \+- [\d.]+ of what /load says\.", first)
    assert told and float(told[1]) == pytest.approx(1.0 / said, rel=0.02)


@pytest.mark.parametrize("rigid", (False, True))
def test_true_loads_are_not_blamed(tmp_path, rigid):
    found = diagnose_rests(lever(tmp_path, rigid=rigid), [hanging(60, 4, rigid=rigid)])
    assert "loads" not in headline(found)
    assert next(c for c in found.candidates if c.label == SCALE).verdict == "absent"


def test_without_loads_their_size_is_not_asked(tmp_path):
    rests = hanging(30, 4, rigid=True)
    rests = replace(rests, u=rests.u - 0.5 * rests.forces[:, :1] * np.cos(rests.q_motor), forces=0.0 * rests.forces)
    found = diagnose_rests(lever(tmp_path, rigid=True), [rests])
    scale = next(c for c in found.candidates if c.label == SCALE)
    assert scale.verdict == "untestable" and scale.why == "does nothing at these rests"


def test_the_slope_by_the_share_is_that_of_differences(tmp_path):
    robot = add_effect(lever(tmp_path), SCALE, {"share": 0.1})  # friction follows the weight, so loads widen its band
    problem = RestSet.of(robot, hanging(9, 2))
    x, calibration = problem.start(Calibration.of(robot))
    k, h = calibration.names.index("robot.load_scale.share"), 1e-4
    step = h * np.eye(len(calibration.names))[k]
    found = problem.torques(x, calibration)
    up, down = (
        problem.torques(x, calibration.with_points({"dynamics": calibration.dynamics + side * step}))
        for side in (1.0, -1.0)
    )
    for part in ("links", "motors", "half", "held"):
        slope = (getattr(up, part).value - getattr(down, part).value) / (2.0 * h)
        np.testing.assert_allclose(getattr(found, part).by_parameter[:, :, k], slope, atol=1e-6)
    assert np.abs(found.half.by_parameter[:, :, k]).max() > 0.1
