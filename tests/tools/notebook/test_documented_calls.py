# SPDX-License-Identifier: BSD-3-Clause
"""The example of docs/notebook.md, run as it stands there, and what its functions refuse."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import jointscope as js

pytest.importorskip("mujoco", reason="the page simulates its recording")

PAGE = Path(__file__).parents[3] / "docs" / "notebook.md"
BLOCK = re.compile(
    r"<!-- executed by tests/tools/notebook/test_documented_calls.py -->\n```python\n(.*?)```", re.DOTALL
)


@pytest.mark.slow
def test_the_example_of_the_page_runs_and_leaves_its_files(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = run_block(0)
    told, *said = capsys.readouterr().out.splitlines()
    answer = names["replayed"].answer().splitlines()
    replayed, exported = said[: len(answer)], said[len(answer)]
    labels = ("start", "calibrated", "with motor_viscous")
    errors = ", ".join(rf"{label}: [\d.]+ sigma \(floor [\d.]+\)" for label in labels)
    assert re.match(f"Error 0.1 s ahead, {errors}", told)
    assert replayed == answer
    assert exported.startswith("Wrote doggy.urdf: inertias, dry friction, springs of joint1")
    left = {"train.mcap", "calibrated.yaml", "calibration.html", "doggy.urdf", "doggy.xml", "comparison.svg"}
    assert {file.name for file in tmp_path.iterdir()} == left
    assert js.load_robot("calibrated.yaml").parameters["joint2.stiffness"].sigma is not None


@pytest.mark.slow
def test_the_example_of_a_discovery_finds_what_was_hidden(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_block(1)
    diagnosed, steps = capsys.readouterr().out.splitlines()
    assert diagnosed == "The model is not adequate: it lacks motor_viscous@joint2."
    assert steps == "['base model', '+ motor_viscous@joint2']"
    assert {file.name for file in tmp_path.iterdir()} == {"seen.mcap", "unseen.mcap", "found.yaml", "story.html"}


def run_block(number: int) -> dict:
    """Runs a block of the page; returns its names."""
    names: dict = {}
    exec(compile(BLOCK.findall(PAGE.read_text(encoding="utf-8"))[number], str(PAGE), "exec"), names)
    return names


def test_every_name_of_the_facade_stands_on_the_page():
    text = PAGE.read_text(encoding="utf-8")
    for name in js.__all__:
        assert f"`{name}`" in text, name


def test_errors_are_those_of_the_command_line():
    with pytest.raises(js.JointscopeError, match="nobody"):
        js.calibrate("nobody", "train.mcap")
    with pytest.raises(js.errors.RecordingError, match=r"train\.mcap"):
        js.calibrate("doggy", "train.mcap")
    with pytest.raises(js.errors.EffectError, match="no_effect"):
        js.add("doggy", "no_effect@joint1")
    with pytest.raises(js.errors.RobotError, match=r"doggy, doggy: two models have one name; give labels"):
        js.compare(["doggy", js.load_robot("doggy")], "train.mcap")


def test_a_notebook_shows_one_line_of_an_error():
    error = js.errors.RobotError("there is no such joint")
    assert error._render_traceback_() == ["RobotError: there is no such joint"]
