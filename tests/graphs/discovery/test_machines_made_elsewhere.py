# SPDX-License-Identifier: BSD-3-Clause
"""Slides and a rotary drive as real ones are, made by a program that shares no code with this one: `discover` on each.

From what `init` writes, with the held-out recording; each answer against its truth.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from jointscope.graphs.discovery.discover import discover
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

DATA = Path(__file__).parents[4] / "shared" / "data"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not (DATA / "slide").is_dir(), reason="shared/data/slide is not beside the project"),
]
WITHIN = 3.0  # [sigma]


def found_in(folder: Path, tmp_path: Path, unit: str):
    """What `discover` says from what `init` writes, and the truth."""
    path, (urdf,) = tmp_path / "robot.yaml", folder.glob("*.urdf")
    assert main(["init", str(urdf), str(folder / "train"), "--unit", unit, "-o", str(path)]) == 0
    robot = load_robot(path)
    train, test = (read_recording(folder / name, robot) for name in ("train", "test"))
    return discover(robot, [train], holdout=test, missing_torque=False), truth_of(folder)


def added(found):
    return [step.added for step in found.steps if step.added]


def assert_near(parameter, value):
    assert abs(parameter.value - value) < WITHIN * parameter.sigma, (parameter.name, parameter.value, parameter.sigma)


@pytest.mark.parametrize("name", ("offset", "direction", "stribeck", "quiet", "small_only"))
def test_the_large_effect_of_a_slide_comes_first_with_its_size_and_nothing_false(name, tmp_path):
    found, truth = found_in(DATA / "slide" / name, tmp_path, "Nm")
    values, labels = found.robot.parameters, added(found)
    if name in ("offset", "direction"):
        # half of the asymmetry is an offset while the slide moves, which motion does not tell from a constant
        assert labels[0] == "torque_offset@carriage"
        constant = -truth["offset"] if name == "offset" else 0.5 * truth["asymmetry"]
        assert_near(values["carriage.torque_offset.torque"], constant)
    elif name == "stribeck":
        assert labels[0] == "motor_stribeck@carriage"
        assert_near(values["carriage.motor_stribeck.torque"], truth["stribeck"] * truth["coulomb"])
        assert values["carriage.motor_stribeck.velocity"].value == pytest.approx(0.01, rel=0.05)
    else:
        assert labels == [], f"nothing but small ripples is there: {found.steps[0].diagnosis.small}"
    for label in labels[bool(name in ("offset", "direction", "stribeck")) :]:
        assert label == "cogging@carriage"  # a true ripple
    assert_near(values["carriage.motor_viscous.coefficient"], truth["viscous"])
    assert found.adequate
    if name == "small_only":
        assert any(text.startswith("cogging@carriage") for text in found.steps[-1].diagnosis.small)


@pytest.mark.parametrize("name", ("linear", "hardening"))
def test_a_rotary_drive_declared_rigid_gets_its_spring_then_what_the_link_feels(name):
    folder = DATA / "rotary" / name
    robot = load_robot(folder / "rotary.yaml")
    train, test = (read_recording(folder / part, robot) for part in ("train", "test"))
    found = discover(robot, [train], holdout=test, missing_torque=False)
    assert_is_the_rotary_drive(found, folder, ["joint_elasticity@arm"])
    compliance = found.robot.parameters["arm.joint_elasticity.compliance"]
    assert_near(compliance, 1.0 / truth_of(folder)["stiffness"])


@pytest.mark.parametrize("name", ("linear", "hardening"))
def test_a_rotary_drive_whose_spring_two_encoders_tell_gets_what_the_link_feels(name, tmp_path):
    folder = DATA / "rotary" / name
    found, truth = found_in(folder, tmp_path, "V")
    assert_is_the_rotary_drive(found, folder, [])
    assert_near(found.robot.parameters["arm.stiffness"], truth["stiffness"])


def assert_is_the_rotary_drive(found, folder, first):
    values, labels, truth = found.robot.parameters, added(found), truth_of(folder)
    later = {"linear": ["link_viscous@arm"], "hardening": ["spring_cubic@arm", "link_viscous@arm"]}[folder.name]
    assert labels == first + later
    if truth["cubic"]:
        assert_near(values["arm.spring_cubic.stiffness"], truth["cubic"])
    assert all(step.floor <= step.heldout_error for step in found.steps)


def truth_of(folder):
    return json.loads((folder / "truth.json").read_text(encoding="utf-8"))
