# SPDX-License-Identifier: BSD-3-Clause
"""Rests beside poses and frequency responses of one arm that another program simulated, without motion."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="arms are moved by MuJoCo, which the extra `sim` brings")

from resting_axes import posed, rested, resting_axes, write_rests
from three_axes import POSES

import jointscope as js
from jointscope.graphs.joint_kinds.calibrate_kinds import calibrate_kinds
from jointscope.graphs.joint_kinds.calibrate_with_rests import calibrate_with_rests
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.pose_table import pose_table
from jointscope.tools.command_line import main
from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
from jointscope.tools.simulator.pose_simulation import PoseConditions
from jointscope.tools.verdicts.rests.beside_motion import TOLD
from jointscope.tools.verdicts.with_rests_judgement import judge_with_rests

SPRINGS = ["joint2.stiffness", "joint3.stiffness"]  # the first axis is upright, and nothing hangs on it
DRY = [f"joint{j}.coulomb_torque" for j in (1, 2, 3)]
SEED = 3


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """Robot, rests, poses and true values."""
    robot = resting_axes(tmp_path_factory.mktemp("resting"))
    poses, truth = posed(robot, 40, SEED)
    return robot, rested(robot, 30, SEED), poses, truth


@pytest.fixture(scope="module")
def with_poses(arm):
    robot, rests, poses, _ = arm
    return calibrate_with_rests(robot, [rests], [poses])


def sigmas(robot, names):
    return np.array([robot.parameters[name].sigma for name in names])


def within(robot, truth, names, most=3.0):
    for name in names:
        p = robot.parameters[name]
        assert abs(p.value - truth[name]) < most * p.sigma, name


def test_rests_and_poses_have_the_truth_with_the_sigmas_of_the_better_one(arm, with_poses):
    robot, rests, poses, truth = arm
    free = [name for name, p in robot.parameters.items() if not p.fixed and name in truth]
    within(with_poses.robot, truth, free)
    by_rests, by_poses = calibrate_rests(robot, [rests]).robot, calibrate_poses(robot, [poses]).robot
    assert np.all(sigmas(with_poses.robot, SPRINGS) < 1.02 * sigmas(by_rests, SPRINGS))
    assert np.all(sigmas(with_poses.robot, SPRINGS) < 0.2 * sigmas(by_poses, SPRINGS))
    geometry = ["joint1.mis_x", "joint2.lx", "joint2.mis_x", "joint3.lz"]
    assert np.all(sigmas(with_poses.robot, geometry) < 1.05 * sigmas(by_poses, geometry))
    assert with_poses.agreement.dof >= 2 and with_poses.agreement.p_value > 0.01
    assert judge_with_rests(with_poses).checks[0].level == "good"


def test_its_graph_prints_and_has_the_same_sigmas(with_poses):
    g = js.graph(with_poses)
    assert g.kinds == ("poses", "rests") and "rests" in str(g)
    found = g.sigmas(g.values)
    for name in SPRINGS:
        assert found[name] == pytest.approx(with_poses.robot.parameters[name].sigma, rel=0.05)


def test_a_drive_that_is_softer_at_rest_is_a_contradiction(arm):
    robot, _, poses, _ = arm
    found = calibrate_with_rests(robot, [rested(robot, 30, SEED, softer=1.2)], [poses])
    agree, *_ = judge_with_rests(found).checks
    assert found.agreement.doubtful and agree.level == "bad" and "Rests contradict poses" in agree.text


def test_a_rest_or_two_that_tell_nothing_are_no_yes(arm):
    robot, rests, poses, _ = arm
    few = calibrate_with_rests(robot, [rests.only(np.arange(30) < 1)], [poses])
    judgement = judge_with_rests(few)
    (untold,) = [check for check in judgement.checks if check.name == TOLD]
    assert judgement.level == "warn" and untold.level == "warn" and untold.text.startswith("These rests ")


def test_rests_alone_have_a_function_of_their_own(arm):
    robot, rests, *_ = arm
    with pytest.raises(RecordingError, match="calibrate_rests"):
        calibrate_with_rests(robot, [rests])


@pytest.mark.slow
@pytest.mark.parametrize("posed_too", [False, True])
def test_responses_keep_their_sigmas_and_rests_tell_what_they_cannot(arm, posed_too):
    robot, rests, poses, truth = arm
    shaking = Shaking(poses=[np.array(pose) for pose in POSES], realisations=1)
    made, _, _ = simulate_frequency(robot, SEED, PoseConditions(), shaking)
    shaken, sessions = [(one.signals, one.excitation) for one in made], [poses] if posed_too else []
    found = calibrate_with_rests(robot, [rests], sessions, shaken)
    springs, dampers = ([f"joint{j}.{part}" for j in (1, 2, 3)] for part in ("stiffness", "damping"))
    within(found.robot, truth, [*springs, *dampers, *DRY])
    assert found.agreement.p_value > 0.01
    if posed_too:
        alone = calibrate_kinds(robot, shaken, sessions).robot
        assert np.all(sigmas(found.robot, springs) < 1.02 * sigmas(alone, springs))
    by_rests = calibrate_rests(robot, [rests]).robot
    assert np.all(sigmas(found.robot, DRY) < 0.1 * sigmas(by_rests, DRY))


def test_the_command_writes_robot_report_and_json_and_says_whether_the_kinds_agree(arm, tmp_path, capsys):
    robot, rests, poses, truth = arm
    weights, table = write_rests(tmp_path / "still.mcap", rests), tmp_path / "poses.csv"
    table.write_text(pose_table(poses, robot), encoding="utf-8")
    out = [tmp_path / f"found.{kind}" for kind in ("yaml", "html", "json")]
    options = [text for pair in zip(("-o", "--report", "--json"), map(str, out), strict=True) for text in pair]
    assert main(["calibrate", str(robot.path), "--rests", str(weights), "--poses", str(table), *options]) == 0
    said = capsys.readouterr().out
    assert "Rests agree with poses: chi-square" in said and "30 rests" in said and "40 poses" in said
    content = json.loads(out[2].read_text(encoding="utf-8"))
    assert {used["kind"] for used in content["recordings"]} == {"rests", "poses"}
    assert content["agreement_with_rests"]["p_value"] > 0.001 and content["rests"] == 30
    page = out[1].read_text(encoding="utf-8")
    ids = re.findall(r'<section id="([^"]+)"', page)
    assert {"poses-verdict", "rests-verdict"} < set(ids) and len(set(ids)) == len(ids)
    within(load_robot(out[0]), truth, [*SPRINGS, *DRY], 4.0)
