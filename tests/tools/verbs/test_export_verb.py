# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope export` from the command line."""

import json

import pytest
from tilted_arm import arm_with

from jointscope.tools.command_line import main
from jointscope.tools.export import mujoco_model

mujoco = pytest.importorskip("mujoco", reason="MuJoCo models need the extra jointscope[sim]")


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
    assert "jointscope export ROBOT --urdf F.urdf --mjcf F.xml" in capsys.readouterr().err


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


def test_a_model_that_mujoco_refuses_is_not_written(tmp_path, capsys, monkeypatch):
    """What compiles as a specification may be refused as text: numbers are rounded there."""
    bad = lambda text: text.replace('diaginertia="', 'diaginertia="9e9 ', 1)  # noqa: E731
    monkeypatch.setattr(mujoco_model, "_possible", bad)
    files = ["--urdf", str(tmp_path / "out.urdf"), "--mjcf", str(tmp_path / "out.xml")]
    assert main(["export", "doggy", *files]) == 1
    said = capsys.readouterr().err
    assert "MuJoCo refuses the model of robot 'doggy'" in said
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_what_readers_stumble_over_is_on_the_screen_and_in_the_json(tmp_path, capsys):
    arm_with(tmp_path)
    text = (tmp_path / "arm.urdf").read_text()
    mesh = '<collision><geometry><mesh filename="package://arm_description/a.stl"/></geometry></collision>'
    (tmp_path / "arm.urdf").write_text(text.replace('<link name="base"/>', f'<link name="base">{mesh}</link>', 1))
    told = tmp_path / "out.json"
    files = ["--urdf", str(tmp_path / "out.urdf"), "--mjcf", str(tmp_path / "out.xml"), "--json", str(told)]
    assert main(["export", str(tmp_path / "arm.yaml"), *files]) == 0
    content, screen = json.loads(told.read_text()), " ".join(capsys.readouterr().out.split())
    (warning,) = content["urdf"]["warnings"]
    assert "arm_description" in warning
    assert f"Note: {warning}" in screen
    assert content["mjcf"]["warnings"] == []
    with pytest.raises(ValueError, match=r"package://|a\.stl"):  # so it is true
        mujoco.MjModel.from_xml_path(str(tmp_path / "out.urdf"))
