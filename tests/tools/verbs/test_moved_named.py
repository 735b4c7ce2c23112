# SPDX-License-Identifier: BSD-3-Clause
"""What moved during a session is named beside the effects that may stand in for it."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from jointscope.graphs.frequency.agreement import Agreement
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.pose_table import pose_table
from jointscope.tools.command_line import main
from jointscope.tools.simulator.pose_simulation import simulate_poses
from jointscope.tools.terminal.poses_text import pose_calibration_text
from jointscope.tools.verdicts.pose_judgement import moved_during, outliers_of
from jointscope.tools.verdicts.same_values import agreed

pytest.importorskip("mujoco", reason="arms are posed by MuJoCo, which the extra `sim` brings")


@pytest.mark.parametrize("size", [0.0, 1.7e-3])
def test_diagnose_from_poses_says_that_a_zero_jumped_and_nothing_where_none_did(tmp_path, capsys, size):
    robot = load_robot("tx90l")
    poses, _ = simulate_poses(robot, 60, 3)
    q = poses.q.copy()
    q[31:, 2] += size
    (tmp_path / "poses.csv").write_text(pose_table(replace(poses, q=q), robot), encoding="utf-8")
    out = tmp_path / "found.json"
    assert main(["diagnose", "tx90l", "--poses", str(tmp_path / "poses.csv"), "--json", str(out)]) == 0
    moved, said = json.loads(out.read_text(encoding="utf-8"))["moved"], capsys.readouterr().out
    if not size:
        assert moved is None and "encoder lost counts" not in said
        return
    assert moved["joint"] == "joint3" and moved["size"] == pytest.approx(size, rel=0.1)
    assert (moved["before"], moved["after"]) == (poses.names[30], poses.names[31])
    assert moved["text"] in said and "may stand in for it" in said


def test_poses_behind_a_step_are_not_listed_as_outliers_and_one_that_is_odd_by_itself_is():
    robot = load_robot("tx90l")
    poses, _ = simulate_poses(robot, 60, 3)
    q, target = poses.q.copy(), poses.target.copy()
    q[51:, 2] += 1.7e-3
    target[5, 1] += 3e-3
    result = calibrate_poses(robot, [replace(poses, q=q, target=target)])
    step = moved_during(result)
    assert step is not None and (step.joint, step.after) == ("joint3", poses.names[51])
    assert {*poses.names[51:], poses.names[5]} <= {each.pose for each in result.left_out}
    assert [each.pose for each in outliers_of(result)] == [poses.names[5]]
    said = pose_calibration_text(result)
    assert f"left out as outliers: pose {poses.names[5]} of" in said and f"pose {poses.names[52]} of" not in said


def test_kinds_without_a_value_in_common_are_not_said_to_agree():
    level, _, said = agreed(Agreement(0.0, 0), "Rests agree with poses", "rests and poses")
    assert level == "info" and "cannot be tested" in said and "agree with" not in said
    level, _, said = agreed(Agreement(3.1, 4), "Rests agree with poses", "rests and poses")
    assert level == "good" and said.startswith("Rests agree with poses: chi-square 3.10 for 4 directions")
