# SPDX-License-Identifier: BSD-3-Clause
"""Functions that change or export a model do what their verbs do."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from fake_results import fake_recording, sinusoids
from tilted_arm import arm_with

import jointscope as js
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.errors import JointscopeError
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main


def test_export_writes_what_the_verb_writes(tmp_path, capsys):
    pytest.importorskip("mujoco", reason="MuJoCo models need the extra jointscope[sim]")
    names = ("a.urdf", "a.xml", "b.urdf", "b.xml", "b.json")
    a_urdf, a_mjcf, b_urdf, b_mjcf, b_json = (tmp_path / name for name in names)
    done = js.export("doggy", urdf=a_urdf, mjcf=str(a_mjcf))
    assert main(["export", "doggy", "--urdf", str(b_urdf), "--mjcf", str(b_mjcf), "--json", str(b_json)]) == 0
    assert a_urdf.read_text() == b_urdf.read_text()
    assert a_mjcf.read_text() == b_mjcf.read_text()
    assert done.to_json() == json.loads(b_json.read_text())
    assert capsys.readouterr().out == done.answer().replace("/a.", "/b.") + "\n"


def test_a_result_of_a_calibration_is_exported_with_its_robot(tmp_path):
    start = js.load_robot("doggy")
    found = start.with_values({"joint2.coulomb_torque": 7.25})
    absent = {field.name: None for field in dataclasses.fields(CalibrationResult)}
    result = CalibrationResult(**{**absent, "robot": found})
    done = js.export(result, urdf=tmp_path / "found.urdf")
    assert 'friction="7.25"' in (tmp_path / "found.urdf").read_text()
    assert set(done.models) == {"urdf"}
    assert "found.urdf" in done._repr_html_()
    assert str(done) == repr(done) == done.answer()


def test_what_was_added_can_be_removed():
    robot = js.load_robot("doggy")
    more = js.add(robot, "cogging@joint1", "motor_viscous@*")
    assert len(more.effects) == len(robot.effects) + 4
    less = js.remove(more, "cogging@joint1", "motor_viscous@*")
    assert less.effects == robot.effects
    assert less.parameters == robot.parameters


def test_info_says_whether_a_robot_can_use_a_bag(tmp_path, capsys):
    robot, t = js.load_robot("doggy"), np.arange(0.0, 2.0, 0.01)
    bag = tmp_path / "moves.mcap"
    write_bag(bag, fake_recording(robot, sinusoids(t, robot), t, np.random.default_rng(0)), robot)
    assert js.info(bag, "doggy").usable
    assert js.info(bag).usable is None
    other = js.info(bag, "hebi_5r")
    assert not other.usable
    assert main(["info", str(bag), "--robot", "hebi_5r"]) == 0
    assert capsys.readouterr().out == other.text() + "\n"


def test_an_export_does_not_replace_the_urdf_of_its_robot(tmp_path):
    robot = arm_with(tmp_path)
    before = (tmp_path / "arm.urdf").read_bytes()
    for kind in ("urdf", "mjcf"):
        with pytest.raises(JointscopeError, match=r"arm\.urdf: it is the URDF of .*arm\.yaml; give it another name"):
            js.export(robot, **{kind: tmp_path / "arm.urdf"})
    assert (tmp_path / "arm.urdf").read_bytes() == before
