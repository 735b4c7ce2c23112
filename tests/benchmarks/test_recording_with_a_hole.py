# SPDX-License-Identifier: BSD-3-Clause
"""A recorder that was stopped and started again an hour later, while the arm moved on: both sides give the values."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="the recording is simulated")

import fuzz_messages

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import main

pytestmark = pytest.mark.slow

HOUR = 3_600_000_000_000  # [ns]
TRUE = {"inertia": (0.3, 0.08), "coulomb_torque": (0.6, 0.2), "motor_viscous.coefficient": (0.8, 0.2)}


def test_values_are_right_from_both_sides_of_a_hole(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(fuzz_messages, "SECONDS", 9.0)
    messages = []
    for message in fuzz_messages.sound_messages.__wrapped__():
        seconds = (message.stamp - fuzz_messages.START_NS) / 1e9
        later = HOUR * (seconds > 5.0)
        if not 1.1 < seconds < 7.9:
            moved = dataclasses.replace(message, stamp=message.stamp + later, received=message.received + later)
            messages.append(moved)
    Path("two.urdf").write_text(fuzz_messages.URDF, encoding="utf-8")
    fuzz_messages.write_messages(Path("train"), messages, "mcap")
    assert main(["init", "two.urdf", "train.mcap", "-o", "two.yaml"]) == 0
    assert main(["calibrate", "two.yaml", "train.mcap", "-o", "found.yaml"]) == 0
    said, beside = capsys.readouterr()
    assert "nothing at all was recorded for 60 min 7 s after 1.08" in said + beside
    assert "Usable" in said and "an effect may be missing" not in said
    robot = load_robot("found.yaml")
    for name, values in TRUE.items():
        for joint, true in zip(("shoulder", "elbow"), values, strict=True):
            value = robot.parameters[f"{joint}.{name}"].value
            assert value == pytest.approx(true, rel=0.01), f"{joint}.{name}"
