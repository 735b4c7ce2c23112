# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import json
from pathlib import Path

import pytest
from fake_results import fake_calibration, fake_comparison

from jointscope.graphs import calibrate as calibrate_module
from jointscope.graphs import compare as compare_module
from jointscope.tools.command_line import main

pytest.importorskip("mujoco", reason="the demo simulates its recordings")

WRITTEN = {
    *("calibration.mcap", "calibration.truth.json", "calibration.html", "calibration.rrd", "doggy_calibrated.yaml"),
    *("moves.mcap", "moves.truth.json", "comparison.html", "comparison.rrd"),
}


@pytest.fixture
def quick(monkeypatch, tmp_path):
    """The demo with made-up results instead of solving; simulation, reading and writing are real."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(calibrate_module, "calibrate", lambda *args, progress: fake_calibration())
    monkeypatch.setattr(compare_module, "compare", lambda *args, progress: fake_comparison())
    return monkeypatch


def test_the_demo_tells_the_story_and_leaves_its_files(quick, capsys):
    assert main(["demo", "-o", "here", "--seconds", "5", "--json", "found.json"]) == 0
    text = capsys.readouterr().out
    for part in (
        "$ jointscope simulate doggy -o here/calibration.mcap --motion calibration --seconds 5 --seed 1 --friction ",
        "$ jointscope calibrate doggy here/calibration.mcap -o here/doggy_calibrated.yaml",
        "$ jointscope compare doggy here/doggy_calibrated.yaml here/moves.mcap",
        "Of 12 parameters",
        "here/comparison.html",
    ):
        assert part in text
    assert {path.name for path in Path("here").iterdir()} == WRITTEN
    assert {path.name for path in Path().iterdir()} == {"here", "found.json"}
    assert set(json.loads(Path("found.json").read_text())) == {"calibration", "truth", "comparison"}


@pytest.mark.parametrize("module", [calibrate_module, compare_module])
def test_ctrl_c_leaves_nothing_behind(module, quick, capsys):
    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    quick.setattr(module, module.__name__.rpartition(".")[2], interrupted)
    assert main(["demo", "--seconds", "5"]) == 1
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
