# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses
import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
from fake_diagnosis import BEARING, fake_discovery

from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import main
from jointscope.tools.verb_parts.demo_truth import against_truth

pytest.importorskip("mujoco", reason="the demo simulates its recordings")

WRITTEN = {
    *("train.mcap", "train.truth.json", "test.mcap", "test.truth.json"),
    *("found.yaml", "found.step0.yaml", "found.step1.yaml", "found.discovery.json"),
    *("discovery.html", "discovery.rrd", "discovery.json", "story.svg", "waterfall.svg", "missing_torque.svg"),
}


def discover(robot, recordings, holdout, *, save, progress):
    """Made-up steps; the second robot has the bearing."""
    result = fake_discovery(0.5)
    bearing = add_effect(robot, BEARING)
    robots = [robot, bearing.with_values({"joint1.bearing_flexibility.compliance_x": 3.9e-4})]
    steps = [dataclasses.replace(s, robot=r) for s, r in zip(result.steps, robots, strict=True)]
    steps = [dataclasses.replace(step, robot_file=save(k, step)) for k, step in enumerate(steps)]
    return dataclasses.replace(result, steps=tuple(steps))


@pytest.fixture
def quick(monkeypatch, tmp_path):
    """The demo with a made-up discovery; simulation, reading and writing are real."""
    monkeypatch.chdir(tmp_path)
    module = SimpleNamespace(discover=discover)
    monkeypatch.setitem(sys.modules, "jointscope.graphs.discovery.discover", module)
    return module


def test_the_demo_tells_the_story_and_leaves_its_files(quick, capsys):
    assert main(["demo", "-o", "here", "--seconds", "3", "--json", "found.json"]) == 0
    text = capsys.readouterr().out
    for part in (
        "$ jointscope simulate doggy -o here/train.mcap --effect bearing_flexibility@joint1 --motion calibration ",
        "$ jointscope simulate doggy -o here/test.mcap --effect bearing_flexibility@joint1 --motion moves --seconds 8 ",
        "$ jointscope discover doggy here/train.mcap --holdout here/test.mcap -o here/found.yaml",
        "here/found.step1.yaml",
        "bearing_flexibility@joint1 was found. Of 12 parameters",
        "here/discovery.html",
    ):
        assert part in text, part
    assert {path.name for path in Path("here").iterdir()} == WRITTEN
    assert {path.name for path in Path().iterdir()} == {"here", "found.json"}
    assert set(json.loads(Path("found.json").read_text())) == {"discovery", "truth"}
    readme = (Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"\"demo/([\w.]+)\"", readme))
    assert {"train.mcap", "test.mcap"} <= named <= WRITTEN  # its lines of Python go on from here
    assert load_robot("here/found.yaml").parameter("joint1.bearing_flexibility.compliance_x").value == 3.9e-4


def test_the_pictures_are_files_of_their_own(quick):
    assert main(["demo", "-o", "here", "--seconds", "3"]) == 0
    for name in ("story.svg", "waterfall.svg", "missing_torque.svg"):
        root = ElementTree.parse(Path("here") / name).getroot()
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert float(root.attrib["width"]) > 100.0


def test_an_effect_that_was_not_found_is_told_as_plainly():
    result = fake_discovery(0.5)
    truth = {name: p.published for name, p in result.robot.parameters.items()}
    alone = dataclasses.replace(result, steps=result.steps[:1])
    assert f"{BEARING} was NOT found." in against_truth(alone, truth, [BEARING])
    other = dataclasses.replace(result.steps[1], added="cogging@joint2")
    wrong = dataclasses.replace(result, steps=(result.steps[0], other))
    told = "was NOT found; cogging@joint2 was added, too, although the simulation does not have it."
    assert told in against_truth(wrong, truth, [BEARING])


def test_ctrl_c_leaves_nothing_behind(quick, capsys):
    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    quick.discover = interrupted
    assert main(["demo", "--seconds", "3"]) == 1
    assert capsys.readouterr().err == "jointscope: error: interrupted; nothing was written\n"
    assert list(Path().iterdir()) == []


def test_a_place_that_cannot_hold_the_demo_is_told_before_the_work(quick, capsys):
    Path("file").write_text("")
    assert main(["demo", "-o", "file"]) == 1
    assert main(["demo", "-o", "no/demo"]) == 1
    assert capsys.readouterr().err == (
        "jointscope: error: cannot write into file: it is a file; expected a folder, or a new name\n"
        "jointscope: error: cannot write no/demo: the folder no does not exist; create it first\n"
    )
