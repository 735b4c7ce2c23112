# SPDX-License-Identifier: BSD-3-Clause
"""Springs behind axes of another simulator, from what `init` writes; friction that sticks, random torques."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"
LABEL = "joint_elasticity@axis"


@pytest.fixture(scope="module", params=[(4, 15.0), (1, 0.0)], ids=["slide with 15 Hz", "rigid wheel"])
def axis(request, tmp_path_factory):
    """An axis of the benchmark's table, its robot and what it did."""
    sys.path.insert(0, str(BENCHMARKS))
    try:
        from spring_axes import record_axis, spring_axes
    finally:
        sys.path.remove(str(BENCHMARKS))
    place, frequency = request.param
    case = replace(spring_axes(100)[place], frequency=frequency)
    folder = tmp_path_factory.mktemp("axis")
    bag = record_axis(case, folder, 12.0)
    path = folder / "axis.yaml"
    assert main(["init", str(folder / "axis.urdf"), str(bag), "--unit", "Nm", "-o", str(path)]) == 0
    robot = load_robot(path)
    return case, robot, read_recording(bag, robot)


@pytest.mark.slow
def test_a_spring_is_named_first_with_its_size_and_none_where_none_is(axis):
    case, robot, recording = axis
    found = diagnose(robot, [recording], missing_torque=False)
    if not case.frequency:
        assert all(c.verdict != "missing" for c in found.candidates) and found.adequate
        return
    first = found.candidates[0]
    assert (first.label, first.verdict) == (LABEL, "missing")
    assert first.parameters["compliance"].value == pytest.approx(case.compliance, rel=5e-3)
    assert abs(first.parameters["compliance"].value - case.compliance) < 3.0 * first.parameters["compliance"].sigma
    assert found.refits[LABEL].has_effect("joint_elasticity", "axis")


def test_links_that_no_sensor_sees_feel_no_random_torque_of_their_own(axis):
    _, robot, _ = axis
    assert not len(robot.noise.unseen)
    assert add_effect(robot, LABEL).noise.unseen.tolist() == [0]


@pytest.mark.slow
def test_friction_of_a_slide_is_held_as_a_sign_as_far_as_it_is_told(axis):
    case, robot, recording = axis
    if not case.slides:
        pytest.skip("friction of joints that turn has no sharpness of its own")
    held = BaseModel.of(robot, [recording]).robot.parameters["axis.friction_sharpness"]
    assert held.fixed and 0.0005 < 3.0 / held.value / case.speed < 0.01
