# SPDX-License-Identifier: BSD-3-Clause
"""`compare --frequency`: what it says, writes and refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest
from shaken_arm import made_up_bag

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import main


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return made_up_bag(tmp_path_factory.mktemp("shaken") / "shaken")


@pytest.fixture(scope="module")
def softer(tmp_path_factory):
    """The ready robot with a soft third drive."""
    path = tmp_path_factory.mktemp("robots") / "softer.yaml"
    source = load_robot("tx90l").path.read_text().replace("urdf: tx90l.urdf", "urdf: ready:tx90l/tx90l.urdf")
    value = f"{load_robot('tx90l').parameters['joint3.stiffness'].value:g}"
    lines = [
        line.replace(value, "9000", 1) if line.strip().startswith("joint3.stiffness") else line
        for line in source.splitlines()
    ]
    path.write_text("\n".join(lines))
    assert load_robot(path).parameters["joint3.stiffness"].value == 9000.0
    return path


def test_models_stand_side_by_side_on_screen_report_and_json(bag, softer, tmp_path, capsys):
    files = ["--report", str(tmp_path / "c.html"), "--json", str(tmp_path / "c.json")]
    assert main(["compare", "tx90l", str(softer), "--frequency", str(bag), *files]) == 0
    screen = capsys.readouterr().out
    assert "error [dB]" in screen and "times the noise" in screen and "softer is furthest off at" in screen
    content = json.loads((tmp_path / "c.json").read_text())
    assert set(content["models"]) == {"tx90l", "softer"} and content["recordings"][0]["kind"] == "frequency"
    own, other = (content["models"][label]["frequency"] for label in ("tx90l", "softer"))
    assert set(own["entries"]) == {f"{i},{j}" for i in (1, 2, 3) for j in (1, 2, 3)}
    assert other["entries"]["3,3"] != own["entries"]["3,3"] and own["rms_log"] > 0.0
    (lines,) = own["lines"].values()
    assert np.shape(lines["db"]) == np.shape(lines["sigmas"]) == (len(lines["frequencies"]), 3, 3)
    page = (tmp_path / "c.html").read_text()
    assert "joint2 to joint1: error [sigma]" in page and "softer" in page and "How far off" in page


def test_what_cannot_be_compared_is_refused_in_a_line(bag, tmp_path, capsys):
    for arguments, text in (
        (["tx90l", "--frequency", bag, "--poses", bag], "give one kind"),
        (["doggy", "--frequency", bag], "has no section `frequency`"),
        (["tx90l", "--frequency", bag, "--rrd", tmp_path / "c.rrd"], "--rrd shows motion"),
        (["tx90l", "--frequency", tmp_path / "none"], "none"),
    ):
        assert main(["compare", *map(str, arguments)]) == 1
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and text in error
