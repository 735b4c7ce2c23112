# SPDX-License-Identifier: BSD-3-Clause
"""A calibration that lacks something is refused with its reason, and the command that it prints makes it right."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from arm_recording import Topic, write_topics
from simulated_arm import SHARP, Arm, moved, written

from jointscope.tools.command_line import main

pytestmark = pytest.mark.slow
ARM = Arm()
LAWS = {"inertia": ARM.inertia, "coulomb_torque": ARM.dry, "motor_viscous.coefficient": ARM.viscous}
HOW = {"seconds": 10.0, "encoder_rate": 250.0, "command_rate": 250.0}


def offset(_, u, __, ___):
    return u + np.array([0.6, 0.0, 0.1])


def taken_up(t, u, model, _):
    if t >= 5.0 and model.body_mass[-1] < 1.2:
        model.body_mass[-1] += 0.8
    return u


def back_emf(_, u, __, data):
    limit = np.array([55.0, 24.0, 6.5])
    slope = np.array([10.0, 4.0, 1.0])
    return np.clip(u, -limit - slope * data.qvel, limit - slope * data.qvel)


def growing(_, u, __, data):
    return u - 0.08 * np.abs(u - data.qfrc_bias) * np.tanh(SHARP * data.qvel)


def typed(capsys, line):
    assert main(shlex.split(line)) == 0
    return capsys.readouterr().out


def refused(drive, capsys):
    """What a calibration says of a drive, in a folder with the files."""
    encoder, command = moved(ARM, drive=drive, **HOW)
    states = Topic("/joint_states", encoder.times, ARM.joints, {"position": encoder.values})
    commands = Topic("/motor_command", np.maximum(command.times, 1e-4), ARM.joints, {"effort": command.values})
    write_topics(Path("train.mcap"), [states, commands])
    typed(capsys, "init arm.urdf train.mcap -o arm.yaml --unit Nm")
    said = typed(capsys, "calibrate arm.yaml train.mcap -o c.yaml")
    assert "\nNo, do not rely on this calibration yet." in said
    return said


def assert_right(path):
    values = json.loads(path.read_text())["parameters"]
    for law, truth in LAWS.items():
        for joint, value in zip(ARM.joints, truth, strict=True):
            found = values[f"{joint}.{law}"]
            assert abs(found["value"] - value) < max(0.02 * value, 3.5 * found["sigma"]), (joint, law)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(ARM, tmp_path)
    return tmp_path


def test_an_offset_is_named_instead_of_a_mass_and_adding_it_makes_the_values_right(folder, capsys):
    said = refused(offset, capsys)
    assert "The recording asks for torque_offset@j0" in said and "another mass" not in said
    advice = re.search(r"Add it: `jointscope ([^`]*)`", said).group(1)
    typed(capsys, advice)
    mended = typed(capsys, f"calibrate {advice.split()[-1]} train.mcap -o d.yaml --json d.json")
    assert "\nNo, " not in mended
    assert_right(folder / "d.json")


def test_a_load_taken_up_is_told_with_its_time_and_the_part_before_is_right(folder, capsys):
    said = refused(taken_up, capsys)
    told = re.search(r"One load throughout\? From (\S+) s .*?the rest with `jointscope ([^`]*)`", said)
    moment, before = told.groups()
    assert float(moment) == pytest.approx(5.0, abs=0.15)
    assert "\nNo, " not in typed(capsys, f"{before} --json d.json")
    assert_right(folder / "d.json")


def test_a_voltage_that_limits_fast_motion_is_told_and_the_rest_is_right(folder, capsys):
    said = refused(back_emf, capsys)
    assert "a limit that falls with speed is that of a supply voltage (back-EMF)" in said
    assert "The recording asks for" not in said and "another mass" not in said
    advice = re.search(r"`jointscope (calibrate [^`]*--leave-out[^`]*)`", said).group(1)
    assert "\nNo, " not in typed(capsys, f"{advice} --json d.json")
    assert_right(folder / "d.json")


def test_friction_that_grows_with_torque_is_no_reason_to_name_anything_else(capsys):
    said = refused(growing, capsys)
    assert re.search(r"the dry friction of .* grows with the torque that the drive passes on", said)
    assert "The recording asks for" not in said
