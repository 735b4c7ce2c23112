# SPDX-License-Identifier: BSD-3-Clause
"""The answer about poses that MuJoCo made or a real arm: what leaves small residuals but is wrong is said."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lever_of_all_kinds import Lever
from measured_poses import PANDA

from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.untold_distances import untold_distance
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.pose_table import pose_table
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses
from jointscope.tools.terminal.poses_text import pose_calibration_text, silent_sentences
from jointscope.tools.verdicts.pose_judgement import judge_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")


@pytest.fixture(scope="module")
def tx90l():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def panda():
    return load_robot("panda")


def check_of(result, name):
    return next(check for check in judge_poses(result).checks if check.name.startswith(name))


@pytest.mark.parametrize("seed", [100, 101])
def test_a_clean_arm_lacks_nothing(tx90l, seed):
    assert judge_poses(calibrate_poses(tx90l, [simulate_poses(tx90l, 60, seed)[0]])).level == "good"


def test_a_payload_that_hides_in_the_repeatability_is_no_yes(tx90l):
    conditions = PoseConditions(effects=["payload@robot:mass=1"])
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 60, 3, conditions)[0]])
    check = check_of(result, "An effect that is missing")
    assert result.repeatability < 3.0 and check_of(result, "Residuals as the arm repeats").level == "good"
    assert judge_poses(result).level == "warn"
    assert check.text.startswith("What is left looks like payload@robot, about 0.9") and "diagnose" in check.text


@pytest.mark.skipif(not PANDA.is_dir(), reason="shared/data/real/panda_sockets is not beside the project")
@pytest.mark.parametrize(("said", "level"), [(0.05, "good"), (0.055, "bad")])
def test_real_sockets_that_are_said_to_be_further_apart_than_they_are_stretch_no_arm_unseen(panda, said, level):
    robot = replace(panda, poses=replace(panda.poses, contact_distance=said))
    result = calibrate_poses(robot, [read_poses(PANDA / "panda_1.csv", robot)])
    found = untold_distance(result)
    assert abs(found.found - 0.05) < 2.0 * found.sigma < 1e-3
    check = check_of(result, "Contacts as far apart")
    assert check.level == level
    assert ("sigma from the 55.00 mm that panda.yaml says" in check.text) is (level == "bad")


def test_nothing_is_said_of_distances_where_a_tracker_measures(tx90l):
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 40, 100)[0]])
    assert untold_distance(result) is None
    assert not any(check.name.startswith("Contacts") for check in judge_poses(result).checks)


def test_errors_of_a_size_that_no_geometry_has_are_a_no(tx90l):
    conditions = PoseConditions(values={"joint3.lz": 0.025})
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 60, 3, conditions)[0]])
    check = check_of(result, "Errors of a size")
    assert check.level == "bad" and "joint3.lz (25" in check.text and "contact_distance" not in check.text


def test_drives_that_are_rigid_have_bounds_and_lack_no_effect(tx90l):
    """The springs of the model are not there: what their priors leave of sag is no effect of another kind."""
    springs = {n: 1e12 for n in tx90l.parameters if "stiffness" in n}
    result = calibrate_poses(tx90l, [simulate_poses(tx90l, 60, 4, PoseConditions(values=springs))[0]])
    (said,) = (text for text in silent_sentences(result) if text.startswith("Too stiff"))
    bounds = {name: float(bound) for name, bound in re.findall(r"(\S+) above (\d+) N m/rad", said)}
    assert "joint3.stiffness" in bounds and all(bounds[n] > tx90l.parameters[n].prior for n in bounds)
    assert all(name not in text for name in bounds for text in silent_sentences(result) if "say nothing" in text)
    assert check_of(result, "An effect that is missing").level == "good"


def test_transmissions_that_add_nothing_have_no_tiny_number(tx90l):
    exact = replace(tx90l, poses=replace(tx90l.poses, joint_sigmas=np.full(tx90l.n, 1e-12)))
    result = calibrate_poses(tx90l, [simulate_poses(exact, 60, 3)[0]])
    shown = pose_calibration_text(result)
    small = float(np.median(result.robot.poses.joint_sigmas)) < 0.05 * tx90l.poses.target_sigma
    assert ("explains the residuals; transmissions repeat better" in shown) is small
    assert "·10" not in check_of(result, "Residuals as the arm repeats").text


def test_a_path_in_the_place_of_poses_is_told_how_to_read_it(tx90l):
    for given in ("poses.csv", ["poses.csv"], [Path("poses.csv")]):
        with pytest.raises(RecordingError, match=r"expected a list of poses, got .*read_poses\(path, robot\)\]"):
            calibrate_poses(tx90l, given)


def test_python_of_the_page_about_poses_runs(tx90l, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "poses.csv").write_text(pose_table(simulate_poses(tx90l, 40, 100)[0], tx90l))
    page = (Path(__file__).resolve().parents[3] / "docs" / "poses.md").read_text()
    (block,) = re.findall(
        r"<!-- executed by tests/tools/verdicts/test_pose_judgement.py -->\n```python\n(.*?)```", page, re.S
    )
    exec(block, {})
    said = capsys.readouterr().out
    assert said.startswith("Yes") and "joint3.stiffness" in said


def test_an_effect_of_the_file_that_poses_leave_out_is_told(tmp_path):
    lever = Lever(tmp_path)
    curve = {"swing.spring_curve.quadratic": 0.0, "swing.spring_curve.cubic": 8e3}
    bent = add_effect(lever.robot, "spring_curve@swing")
    found = [calibrate_poses(robot, [lever.seen()]) for robot in (bent.with_values(curve), bent)]
    said, none = ([c for c in judge_poses(r).checks if c.name.startswith("Effects of the robot")] for r in found)
    assert [check.level for check in said] == ["warn"] and none == []
    assert said[0].text.startswith("spring_curve@swing of lever.yaml acts at rest, too, and poses leave it out")


def test_rows_of_one_name_are_told(tx90l, tmp_path):
    text = pose_table(simulate_poses(tx90l, 10, 100)[0], tx90l).splitlines()
    text[2] = text[1].split(",")[0] + text[2][text[2].index(",") :]
    (tmp_path / "poses.csv").write_text("\n".join(text))
    (notice,) = read_poses(tmp_path / "poses.csv", tx90l).notices
    assert "2 of 10 rows share their name" in notice.text and "as 2 rows named 0" in notice.text
