# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope export` from the command line."""

import json

import pytest
from tilted_arm import arm_with

from jointscope.tools.command_line import main

pytest.importorskip("mujoco", reason="MuJoCo models need the extra jointscope[sim]")


def test_both_models_and_what_they_lack(tmp_path, capsys):
    urdf, mjcf, told = (tmp_path / name for name in ("out.urdf", "out.xml", "out.json"))
    assert main(["export", "doggy", "--urdf", str(urdf), "--mjcf", str(mjcf), "--json", str(told)]) == 0
    screen, content = capsys.readouterr().out, json.loads(told.read_text())
    assert urdf.read_text().startswith("<?xml")
    assert "<mujoco" in mjcf.read_text()
    assert set(content) == {"robot", "urdf", "mjcf"}
    assert "k_mi" in content["urdf"]["lacks"]
    assert "each 15.563 N m s/rad" in screen


def test_nothing_to_write_names_the_command(capsys):
    assert main(["export", "doggy"]) == 1
    assert "jointscope export doggy --urdf F.urdf --mjcf F.xml" in capsys.readouterr().err


def test_neither_is_written_where_one_cannot_be(tmp_path, capsys):
    urdf = tmp_path / "out.urdf"
    assert main(["export", "tx90l", "--urdf", str(urdf), "--mjcf", str(tmp_path / "out.xml")]) == 1
    assert "describes poses" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_robots_own_urdf_is_not_overwritten(tmp_path, capsys):
    arm_with(tmp_path)
    before = (tmp_path / "arm.urdf").read_text()
    assert main(["export", str(tmp_path / "arm.yaml"), "--urdf", str(tmp_path / "arm.urdf")]) == 1
    assert "it is the URDF of" in capsys.readouterr().err
    assert (tmp_path / "arm.urdf").read_text() == before
