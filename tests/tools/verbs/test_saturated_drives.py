# SPDX-License-Identifier: BSD-3-Clause
"""Drives that saturate, through the verbs as they are typed: told, modelled, and then right."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from arm_recording import Topic, write_topics
from arm_verbs import Typed
from simulated_arm import Arm, moved, written

from jointscope.tools.command_line import main

pytestmark = pytest.mark.slow
ARMS = {
    "three joints": (Arm(), 1, 0.7),
    "a slide": (Arm("yX", inertia=(0.7, 6.0), dry=(2.0, 1.0), viscous=(1.5, 9.0)), 1, 0.6),
}


def typed(capsys, line: str) -> Typed:
    code = main(line.split())
    out, err = capsys.readouterr()
    return Typed(line, code, out, err, 0.0, 0.0)


@pytest.mark.parametrize("name", list(ARMS))
def test_a_drive_that_saturates_is_told_and_modelled_and_all_values_are_right(name, tmp_path, monkeypatch, capsys):
    arm, joint, share = ARMS[name]
    limit = share * float(np.abs(moved(arm)[1].values[:, joint]).max())
    most = tuple(limit if j == joint else np.inf for j in range(len(arm.joints)))
    encoder, command = moved(arm, most=most)
    monkeypatch.chdir(tmp_path)
    written(arm, tmp_path)
    states = Topic("/joint_states", encoder.times, arm.joints, {"position": encoder.values})
    drive = Topic("/motor_command", np.maximum(command.times, 1e-4), arm.joints, {"effort": command.values})
    write_topics(tmp_path / "train.mcap", [states, drive])

    found = typed(capsys, "init arm.urdf train.mcap -o arm.yaml --unit Nm")
    unit = "N" if arm.axes[joint].isupper() else "N m"
    level, share_said = re.search(
        rf"{arm.joints[joint]} gives no more than (\S+) {unit} \((\S+) % of its commands are beyond\)", found.out
    ).groups()
    assert float(level) == pytest.approx(limit, rel=3e-3)
    assert float(share_said) == pytest.approx(100.0 * np.mean(np.abs(command.values[:, joint]) > limit), abs=0.6)
    assert "saturate" not in typed(capsys, "info train.mcap --robot arm.yaml").out
    right = typed(capsys, "calibrate arm.yaml train.mcap -o c.yaml --json c.json")
    assert right.code == 0 and not right.refused
    assert_right(arm, joint, limit, tmp_path / "c.json")
    assert typed(capsys, "replay c.yaml train.mcap").code == 0

    # a robot file from elsewhere knows of no limit: every verb says so, and what to type helps
    assert typed(capsys, f"remove arm.yaml command_limit@{arm.joints[joint]} -o plain.yaml").code == 0
    told = typed(capsys, "info train.mcap --robot plain.yaml")
    assert f"drives saturate; whatever is commanded, the motion shows of {arm.joints[joint]} no more" in told.out
    refused = typed(capsys, "calibrate plain.yaml train.mcap -o p.yaml")
    assert refused.refused and "Drives that give what is commanded?" in refused.out
    advice = refused.next_command()
    assert advice == f"add plain.yaml command_limit@{arm.joints[joint]} -o plain_limited.yaml"
    assert typed(capsys, advice).code == 0
    helped = typed(capsys, "calibrate plain_limited.yaml train.mcap -o c.yaml --json c.json")
    assert helped.code == 0 and not helped.refused
    assert_right(arm, joint, limit, tmp_path / "c.json")


def assert_right(arm, joint, limit, path):
    values = json.loads(path.read_text())["parameters"]
    laws = {"inertia": arm.inertia, "coulomb_torque": arm.dry, "motor_viscous.coefficient": arm.viscous}
    for law, truth in laws.items():
        for name, value in zip(arm.joints, truth, strict=True):
            found = values[f"{name}.{law}"]
            assert abs(found["value"] - value) < max(0.01 * value, 3.5 * found["sigma"]), (name, law)
    assert values[f"{arm.joints[joint]}.command_limit.limit"]["value"] == pytest.approx(limit, rel=2e-3)
