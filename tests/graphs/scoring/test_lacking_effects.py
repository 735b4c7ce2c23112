# SPDX-License-Identifier: BSD-3-Clause
"""What a model lacks makes values wrong with small sigmas: the calibration says what, and adding it heals them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from simulated_arm import Arm, assert_right, moved, robot_file

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.stages import solved_windows
from jointscope.graphs.scoring.regression.asked_by_regression import Asked
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.verdicts.judgement import judge

ARM = Arm(axes="zy", inertia=(0.3, 0.1), dry=(0.9, 0.5), viscous=(0.6, 0.3))
MOST_STEPS = 4


def calibrated(robot, streams):
    encoder, command = streams
    return calibrate(robot, [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])


def check(result):
    return next(check for check in judge(result).checks if check.name.endswith("missing effect would change"))


def as_advised(robot, streams):
    """Calibrations, each with the effect that the one before asked for, until none is."""
    found = [calibrated(robot, streams)]
    while check(found[-1]).level == "bad" and len(found) <= MOST_STEPS:
        first = next((e for e in found[-1].lacking if e.moved(found[-1].found)), None)
        for effect in found[-1].asked.causes or filter(None, [first]):
            robot = add_effect(robot, effect.label)
        found.append(calibrated(robot, streams))
    return found


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return load_robot(robot_file(ARM, tmp_path_factory.mktemp("arm")))


def test_nothing_is_asked_for_where_nothing_is_missing(robot):
    result = calibrated(robot, moved(ARM, seconds=6.0))
    assert check(result).level == "good"
    assert_right(ARM, result.parameters, 0.01)


def test_cables_that_pull_are_asked_for_and_make_the_values_right(robot):
    streams = moved(ARM, seconds=8.0, cable=1.5)
    result = calibrated(robot, streams)
    wrong = {p.name: p.value for p in result.parameters}
    assert abs(wrong["j0.inertia"] / 0.3 - 1.0) > 0.05, "the cables must do harm"
    assert judge(result).level == "bad" and "parallel_spring@j0" in check(result).text
    file = str(robot.path).removesuffix(".yaml")
    labels = "parallel_spring@j0 parallel_spring@j1"
    assert f"`jointscope add {file}.yaml {labels} -o {file}_parallel_spring.yaml`" in check(result).text
    # where regression has no name for it, a search is advised
    result = replace(result, asked=Asked())
    asked = f"`jointscope discover {file}.yaml arm.mcap --holdout"
    assert f"{asked}-share 0.33 -o {file}_better.yaml`" in check(result).text
    (bag,) = result.bags
    other = replace(bag, recording=replace(bag.recording, path="other.mcap"))
    text = check(replace(result, bags=(bag, other))).text
    assert f"{asked} other.mcap -o {file}_better.yaml`" in text
    for joint in ARM.joints:
        robot = add_effect(robot, f"parallel_spring@{joint}")
    mended = calibrated(robot, streams)
    assert check(mended).level == "good"
    assert_right(ARM, mended.parameters, 0.02)


def test_windows_of_a_long_recording_lose_no_cause(robot, monkeypatch):
    streams = moved(ARM, seconds=30.0, encoder_rate=250.0, cable=0.3)
    windows = []
    cut = solved_windows.windows_of
    monkeypatch.setattr(solved_windows, "windows_of", lambda *of: windows.append(cut(*of)) or windows[-1])
    by_windows = calibrated(robot, streams).lacking
    assert len(windows) == 1 and 3 <= len(windows[0]) <= 6
    monkeypatch.setattr(solved_windows, "LONG", np.inf)
    of_all = calibrated(robot, streams).lacking
    assert len(windows) == 1
    assert "parallel_spring" in {e.effect for e in by_windows}
    assert [(e.label, e.p_value, e.with_it) for e in by_windows] == [(e.label, e.p_value, e.with_it) for e in of_all]


def test_commands_that_a_driver_cut_are_asked_for_and_make_the_values_right(robot):
    encoder, command = moved(ARM, seconds=8.0, command_rate=200.0, encoder_rate=200.0)
    steps = 0.2 * np.std(command.values, axis=0)
    cut = replace(command, values=steps * np.trunc(command.values / steps))
    found = as_advised(robot, (encoder, cut))
    assert "truncated_command@j" in check(found[0]).text
    assert check(found[-1]).level != "bad"
    for joint, lost in zip(ARM.joints, steps / 2.0, strict=True):
        p = next(p for p in found[-1].parameters if p.name == f"{joint}.truncated_command.lost")
        assert p.value == pytest.approx(lost, rel=0.1)
    truth = {"inertia": ARM.inertia, "coulomb_torque": ARM.dry, "motor_viscous.coefficient": ARM.viscous}
    table = found[-1].found
    for (law, values), i in product(truth.items(), range(2)):
        value = table[f"j{i}.{law}"]
        assert abs(value.value - values[i]) < max(3.5 * value.sigma, 0.01 * values[i]), (law, i)


def test_commands_that_were_rounded_ask_for_nothing(robot):
    encoder, command = moved(ARM, seconds=8.0, command_rate=200.0, encoder_rate=200.0)
    steps = 0.2 * np.std(command.values, axis=0)
    result = calibrated(robot, (encoder, replace(command, values=steps * np.rint(command.values / steps))))
    assert check(result).level == "good"
