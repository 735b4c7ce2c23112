# SPDX-License-Identifier: BSD-3-Clause
"""The verbs on real recordings of robots whose masses are not known."""

import json
from pathlib import Path

import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import main

REAL = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "real"
pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason="shared/data/real is not beside the project")
KR = [str(REAL / "kr300" / f"traj_{k}") for k in "AB"]


def test_discover_writes_robot_report_and_json_and_calibrate_takes_the_robot_again(tmp_path, capsys):
    out, report, numbers = tmp_path / "found.yaml", tmp_path / "r.html", tmp_path / "n.json"
    args = ["discover", "kr300", *KR, "--holdout", str(REAL / "kr300" / "traj_C"), "-o", str(out)]
    assert main([*args, "--report", str(report), "--json", str(numbers)]) == 0
    said = capsys.readouterr().out
    assert "say that it is time" in said
    found = json.loads(numbers.read_text(encoding="utf-8"))
    assert found["steps"][0]["added"] is None
    assert found["steps"][1]["added"] == "encoder_delay@link_encoder"
    assert found["steps"][-1]["heldout_error"] < 0.2 * found["steps"][0]["heldout_error"]
    assert "encoder_delay@link_encoder" in report.read_text(encoding="utf-8")
    assert load_robot(out).has_effect("encoder_delay", "link_encoder")
    assert main(["calibrate", str(out), *KR, "-o", str(tmp_path / "again.yaml")]) == 0


@pytest.mark.slow
def test_the_last_part_of_a_recording_can_be_held_out(tmp_path, capsys):
    bag = str(REAL / "hebi_arms_mit" / "arm5_capstone_robot_data")
    out = ["-o", str(tmp_path / "found.yaml")]
    assert main(["discover", "hebi_5r", bag, "--holdout-share", "0.333", *out]) == 0
    assert "joint_elasticity@joint1" in capsys.readouterr().out
    assert main(["discover", "hebi_5r", bag, bag, "--holdout-share", "0.3", *out]) == 1
    assert "--holdout-share: expected a single BAG, got 2" in capsys.readouterr().err


def test_diagnose_and_compare_have_report_and_json_as_of_every_robot(tmp_path, capsys):
    report, numbers = tmp_path / "r.html", tmp_path / "n.json"
    assert main(["diagnose", "kr300", *KR, "--report", str(report), "--json", str(numbers)]) == 0
    assert "it lacks encoder_delay@link_encoder" in capsys.readouterr().out
    best = json.loads(numbers.read_text(encoding="utf-8"))["candidates"][0]
    assert best["effect"] == "encoder_delay" and best["verdict"] == "missing"
    assert best["parameters"]["delay"]["value"] == pytest.approx(3e-3, abs=2e-4)
    assert main(["compare", "kr300", KR[0], "--report", str(report), "--json", str(numbers)]) == 0
    assert "of each sensor from the others" in capsys.readouterr().out
    horizons = json.loads(numbers.read_text(encoding="utf-8"))["models"]["kr300"]["channels"]["joint_a1.gear"][
        "horizons"
    ]
    assert horizons["0.1"] == horizons["open_loop"] > 1e-4


def test_models_with_and_without_masses_are_not_compared(capsys):
    assert main(["compare", "kr300", "doggy", KR[0]]) == 1
    said = capsys.readouterr().err
    assert "compare those alike" in said and len(said.splitlines()) == 1


def test_a_search_that_was_interrupted_goes_on(tmp_path, capsys):
    args = ["discover", "kr300", *KR, "-o", str(tmp_path / "found.yaml")]
    assert main(args) == 0
    first = capsys.readouterr().out
    assert main(args) == 0
    assert (
        "Continuing after step" in (again := capsys.readouterr().out)
        and again.splitlines()[-3:] == first.splitlines()[-3:]
    )


def test_a_viewer_recording_is_refused_before_anything_is_written(tmp_path, capsys):
    out = tmp_path / "x.yaml"
    assert main(["calibrate", "kr300", KR[0], "-o", str(out), "--rrd", str(tmp_path / "x.rrd")]) == 1
    assert "--rrd is not available" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("robot", "bag"),
    [
        ("hebi_2r", "hebi_arms_mit/arm2_ps2_virtual_spring"),
        ("hebi_3r", "hebi_arms_mit/arm3_ps5_robot_data"),
        ("hebi_5r", "hebi_arms_mit/arm5_milestone_repeat_waypoints"),
        ("kr300", "kr300/traj_C"),
        ("xl330_pendulum", "bam_xl330/kp100_sin_sin"),
    ],
)
def test_info_says_that_each_ready_robot_can_use_its_recordings(robot, bag, capsys):
    assert main(["info", str(REAL / bag), "--robot", robot]) == 0
    assert f"The recording can be used for {robot}." in capsys.readouterr().out
