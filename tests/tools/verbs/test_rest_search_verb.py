# SPDX-License-Identifier: BSD-3-Clause
"""`diagnose` and `discover` with --rests: what is written, said and refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import main

BIOROB = Path(__file__).resolve().parents[4] / "shared" / "data" / "biorob"
SPRING1, SPRING3, GRAVITY = (
    BIOROB / "static_spring/spring1",
    BIOROB / "static_spring/spring3",
    BIOROB / "static_gravity/gravity",
)
pytestmark = pytest.mark.skipif(not BIOROB.is_dir(), reason="shared/data/biorob is not beside the project")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--rests", SPRING1, "--holdout-rests", SPRING1], "is given with --rests and held out; leave it out once"),
        (["--holdout-rests", SPRING1], "--holdout-rests goes with --rests"),
        (
            ["--rests", SPRING1, "--holdout", SPRING3],
            "--holdout is for recordings of motion; leave it out with --rests",
        ),
        (["--rests", SPRING1, "--rrd", "view.rrd"], "--rrd shows motion, not rests; use --report"),
        (["--rests", BIOROB / "clean/train"], "the motors stand 4 % of the time only; expected rests"),
    ],
)
def test_what_does_not_go_together_is_refused_in_one_line(options, text, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["diagnose", "biorob", *map(str, options)]) == 1
    said = capsys.readouterr().err
    assert text in said and len(said.strip().splitlines()) == 1


@pytest.mark.filterwarnings("error")  # a drive that stands exactly is no reason for a warning
@pytest.mark.parametrize(
    ("given", "told"),
    [
        ([SPRING1, "--rests", SPRING3], " N hang on the arm (/load); expected motion"),
        (["--rests", SPRING3, "--poses", "poses.csv"], "biorob.yaml has no section `poses`"),
    ],
)
def test_several_kinds_of_which_one_cannot_be_are_refused_before_anything_is_searched(given, told, tmp_path, capsys):
    assert main(["discover", "biorob", *map(str, given), "-o", str(tmp_path / "o.yaml")]) == 1
    said = capsys.readouterr().err
    assert told in said and len(said.strip().splitlines()) == 1
    assert not (tmp_path / "o.yaml").exists()


def test_limits_go_with_calibrate_and_compare(tmp_path, capsys):
    limits = tmp_path / "limits.yaml"
    limits.write_text(
        "limits:\n  - {parameter: joint1.stiffness, at_least: 0.1 N m/rad, because: rope}\n", encoding="utf-8"
    )
    code = main(["diagnose", "biorob", "--rests", str(SPRING1), "--accept", str(limits)])
    assert code == 1 and "--accept" in capsys.readouterr().err


@pytest.mark.slow
def test_a_spring_that_hardens_is_written_into_robot_file_report_and_json(tmp_path, capsys):
    base, names = tmp_path / "straight.yaml", {"-o": "found.yaml", "--report": "found.html", "--json": "found.json"}
    assert main(["remove", "biorob", "spring_curve@joint1", "-o", str(base)]) == 0
    options = [text for option, name in names.items() for text in (option, str(tmp_path / name))]
    given = ["--rests", str(SPRING1), str(GRAVITY), "--holdout-rests", str(SPRING3)]
    assert main(["discover", str(base), *given, *options]) == 0
    said = capsys.readouterr().out
    assert "Nothing of the catalogue is missing at these rests." in said and "spring_curve@joint1" in said
    robot = load_robot(tmp_path / "found.yaml")
    assert robot.has_effect("spring_curve", "joint1") and robot.parameters["joint1.spring_curve.cubic"].sigma > 0.0
    content = json.loads((tmp_path / "found.json").read_text())
    first, last = content["steps"]
    assert [first["added"], last["added"]] == [None, "spring_curve@joint1"] and content["adequate"]
    assert first["train_error"] > 5.0 > 1.0 > last["train_error"] and set(last["by_kind"]) == {"rests"}
    assert last["missing_torque"]["train"]["joint1"] < 0.1 * first["missing_torque"]["train"]["joint1"]
    leader = first["candidates"][0]
    assert leader["verdict"] == "missing" and leader["by_kind"]["rests"]["helped"] == 1.0 and 0.0 < leader["gain"] < 1.0
    assert {used["kind"] for used in content["recordings"]} == {"rests"}
    page = (tmp_path / "found.html").read_text()
    assert all(text in page for text in ("What was missing", "What may be missing still", "Springs", "Dry friction"))
