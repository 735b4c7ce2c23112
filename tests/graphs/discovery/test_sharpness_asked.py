# SPDX-License-Identifier: BSD-3-Clause
"""How dry friction turns over is asked of the recordings before a search begins: how sharply, and whether it sticks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import SHARP, Arm, assert_right, moved, robot_file

from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.discovery import starting_model as module
from jointscope.graphs.discovery.starting_model import starting_model
from jointscope.graphs.refits.validation import fit_and_judge, judged_error
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.recordings.recording import Recording

ARM = Arm("yx", inertia=(1.5, 0.8), dry=(2.0, 0.8), viscous=(1.5, 0.6))
FILED = 100.0  # [s/rad] in the robot file; SHARP in truth


def recording():
    encoder, command = moved(ARM, seconds=6.0, encoder_rate=250.0, command_rate=250.0)
    return Recording("sharp.mcap", "", 10**18, {"encoder": encoder, "command": command})


@pytest.fixture
def robot(tmp_path):
    path = robot_file(ARM, tmp_path)
    path.write_text(path.read_text().replace("model: {", f"model: {{friction_sharpness: {FILED}, "))
    return load_robot(path)


def test_a_sharper_friction_than_the_file_says_is_found_and_predicts_better(robot, tmp_path):
    base = BaseModel.of(robot, [recording()], by_torques=False)
    found = module._as_sharp_as_told(base)
    before, after = (judged_error(b, b.robot, b.calibrations, fit_and_judge(b)[1]).error for b in (base, found))
    assert after < 0.9 * before
    most = module._told_sharpness(base.robot, base.recordings)
    assert found.robot.sharpness_of("j0") == pytest.approx(SHARP, rel=0.1)
    assert found.robot.sharpness_of("j0") <= 1.001 * most["j0"]  # no sharper than what its encoder tells from a sign
    assert found.robot.sharpness_of("j1") == FILED  # it turns over too quickly for this recording to say
    text = module.turns_over_sharper(robot, found.robot)
    assert text.startswith("Dry friction turns over more sharply than the robot file says (100 s/rad)")
    (tmp_path / "kept.yaml").write_text(robot_text(found.robot, tmp_path))
    kept = load_robot(tmp_path / "kept.yaml")
    assert kept.friction_sharpness() == pytest.approx(found.robot.friction_sharpness())
    assert kept.parameters["j0.friction_sharpness"].fixed
    assert module.turns_over_sharper(kept, kept) == ""
    assert "j0" not in module._told_sharpness(kept, [recording()])  # a sharpness of its own is not asked again


def test_models_judged_by_torques_are_not_asked(monkeypatch, robot):
    base = BaseModel(robot, (recording(),), (), (), None, by_torques=True)
    monkeypatch.setattr(module, "calibrate", None)
    assert module._told_sharpness(robot, base.recordings)
    assert module._as_sharp_as_told(base) is base


def test_joints_that_truly_stick_do_not_bend_the_model_with_which_a_search_begins(tmp_path):
    sticks = Arm("yx", inertia=(0.1, 0.05), dry=(2.0, 0.8), viscous=(0.9, 0.3))
    encoder, command = moved(
        sticks, encoder_rate=200.0, command_rate=200.0, counts=2**16, noise=0.0, pause=0.4, sticks=True
    )
    robot = load_robot(robot_file(sticks, tmp_path))
    sigma = 2.0 * np.pi / 2**16 / np.sqrt(12.0)
    robot = robot.with_sensors({"encoder": replace(robot.motor_encoder, sigmas=np.full(2, sigma))})
    recordings = [Recording("sticks.mcap", "", 10**18, {"encoder": encoder, "command": command})]
    base = starting_model(robot, recordings)
    assert base.by_torques
    assert_right(sticks, base.result.parameters, rel=0.01)
    rounded = BaseModel.of(robot, recordings, by_torques=False)
    with pytest.raises(AssertionError):  # what it would begin with if it believed the law at rest
        assert_right(sticks, rounded.result.parameters, rel=0.01)
