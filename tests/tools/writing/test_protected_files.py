# SPDX-License-Identifier: BSD-3-Clause
"""Results never replace what a robot is made of."""

from __future__ import annotations

import pytest

from jointscope.robots.model.command_words import ready_robots
from jointscope.tools.command_line import main


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A robot file with its URDF beside it."""
    folder = ready_robots()["doggy"].parent
    for name in ("doggy.yaml", "doggy.urdf"):
        (tmp_path / name).write_text((folder / name).read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "arguments",
    [
        ["add", "doggy.yaml", "cogging@joint1", "-o", "doggy.urdf"],
        ["calibrate", "doggy.yaml", "a.mcap", "-o", "doggy.urdf"],
        ["compare", "doggy", "doggy.yaml", "a.mcap", "--json", "doggy.urdf"],
        ["info", "a.mcap", "--robot", "doggy.yaml", "--json", "doggy.urdf"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_the_urdf_of_a_robot_is_not_overwritten(own, arguments, capsys):
    before = (own / "doggy.urdf").read_text(encoding="utf-8")
    assert main(arguments) == 1
    told = "jointscope: error: cannot write doggy.urdf: it is the URDF of doggy.yaml; give it another name\n"
    assert capsys.readouterr().err == told
    assert (own / "doggy.urdf").read_text(encoding="utf-8") == before


def test_a_robot_file_is_not_replaced_by_json(own, capsys):
    assert main(["info", "a.mcap", "--robot", "doggy.yaml", "--json", "doggy.yaml"]) == 1
    assert "cannot write doggy.yaml: it is also an input; give it another name" in capsys.readouterr().err


def test_a_urdf_in_the_place_of_a_robot_file_is_told_what_to_type(own, capsys):
    assert main(["calibrate", "doggy.urdf", "a.mcap", "-o", "out.yaml"]) == 1
    assert (
        "doggy.urdf is a URDF and no robot file; make one with: jointscope init doggy.urdf BAG"
        in capsys.readouterr().err
    )
