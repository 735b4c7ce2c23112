# SPDX-License-Identifier: BSD-3-Clause
"""`--accept`: exit codes, JSON and report of `calibrate`, `compare` and `diagnose` with limits."""

import json
from pathlib import Path

import pytest

from jointscope.tools.command_line import main

DATA = Path(__file__).resolve().parents[4] / "shared/data"
POSES, SLIDE = DATA / "tx90l", DATA / "slide" / "offset"


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    pytest.importorskip("mujoco", reason="the recording is simulated")
    folder = tmp_path_factory.mktemp("accepted")
    path = folder / "train.mcap"
    assert main(["simulate", "doggy", "-o", str(path), "--seconds", "2", "--friction", "smooth"]) == 0
    return path


def limits(folder: Path, *lines: str) -> str:
    path = folder / "limits.yaml"
    path.write_text("limits:\n" + "".join(f"  - {{{line}, because: bench}}\n" for line in lines))
    return str(path)


def test_a_comparison_is_checked_model_by_model(bag, tmp_path, capsys):
    told, page = tmp_path / "out.json", tmp_path / "out.html"
    accept = limits(
        tmp_path,
        "channel: joint1.motor_position, horizon: 0.1, error: 1 nrad",
        "joint: joint1, missing_torque_percent: 5",
    )
    done = main(
        ["compare", "doggy", "doggy_paper", str(bag), "--accept", accept, "--json", str(told), "--report", str(page)]
    )
    assert done == 3
    content = json.loads(told.read_text())
    assert {label: [line["outcome"] for line in lines] for label, lines in content["acceptance"].items()} == {
        "doggy": ["fail", "not evaluated"],
        "doggy_paper": ["fail", "not evaluated"],
    }
    assert "Not accepted: 1 of 2 limits failed." in capsys.readouterr().out
    assert "Not accepted: 1 of 2 limits failed." in page.read_text()


def test_what_cannot_be_told_has_an_exit_code_of_its_own(bag, tmp_path, capsys):
    accept = limits(tmp_path, "parameter: joint1.stiffness, at_most: 1000 N m/rad")
    assert main(["compare", "doggy", str(bag), "--accept", accept]) == 4
    assert "Undecided" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(not SLIDE.is_dir(), reason="shared/data/slide is not beside the project")
def test_a_diagnosis_is_checked_for_torques_that_the_model_lacks(tmp_path, capsys):
    told, page, robot = tmp_path / "out.json", tmp_path / "out.html", tmp_path / "slide.yaml"
    (urdf,) = SLIDE.glob("*.urdf")
    assert main(["init", str(urdf), str(SLIDE / "train"), "--unit", "Nm", "-o", str(robot)]) == 0
    accept = limits(
        tmp_path,
        "joint: carriage, missing_torque_percent: 50",
        'joint: "*", missing_torque_percent: 1.0e-9',
        "channel: carriage.motor_position, horizon: 0.1, error: 1 m",
    )
    done = main(
        ["diagnose", str(robot), str(SLIDE / "train"), "--accept", accept, "--json", str(told), "--report", str(page)]
    )
    assert done == 3
    content = json.loads(told.read_text())
    (lines,) = content["acceptance"].values()
    assert [line["outcome"] for line in lines] == ["pass", "fail", "pass"]
    found = f"{content['missing_torque_percent']['carriage']:.6g} %"
    assert [line["found"] for line in lines[:2]] == [found, found]
    assert "Not accepted: 1 of 3 limits failed." in capsys.readouterr().out
    assert "Not accepted: 1 of 3 limits failed." in page.read_text()


@pytest.mark.slow
def test_of_a_model_that_is_judged_by_predictions_no_torque_passes(bag, tmp_path, capsys):
    accept = limits(tmp_path, "joint: joint1, missing_torque_percent: 50")
    assert main(["diagnose", "doggy", str(bag), "--accept", accept]) == 4
    assert "judged by predictions" in capsys.readouterr().out


def test_limits_of_a_diagnosis_without_motion_are_refused(tmp_path, capsys):
    accept = limits(tmp_path, "joint: joint1, missing_torque_percent: 5")
    assert main(["diagnose", "tx90l", "--poses", str(tmp_path / "poses.csv"), "--accept", accept]) == 1
    assert "jointscope calibrate" in capsys.readouterr().err


@pytest.mark.skipif(not POSES.is_dir(), reason="needs recordings that are not part of this repository")
def test_a_calibration_from_poses_is_checked(tmp_path):
    told, out = tmp_path / "out.json", tmp_path / "arm.yaml"
    table = POSES / "poses_calibration"
    accept = limits(
        tmp_path, "parameter: joint2.backlash, sigma: 1 rad", 'parameter: "joint*.offset", between: [-1, 1 rad]'
    )
    done = main(["calibrate", "tx90l", "--poses", str(table), "-o", str(out), "--accept", accept, "--json", str(told)])
    assert done == 0
    assert {line["outcome"] for line in json.loads(told.read_text())["acceptance"]["tx90l"]} == {"pass"}


def test_a_mistake_in_the_limits_is_told_before_any_work(bag, tmp_path, capsys):
    accept = limits(tmp_path, "parameter: joint1.stiffness, at_mots: 1000")
    assert main(["calibrate", "doggy", str(bag), "-o", str(tmp_path / "out.yaml"), "--accept", accept]) == 1
    assert "did you mean 'at_most'?" in capsys.readouterr().err
    assert not (tmp_path / "out.yaml").exists()
