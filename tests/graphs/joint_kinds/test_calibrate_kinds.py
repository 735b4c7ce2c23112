# SPDX-License-Identifier: BSD-3-Clause
"""Poses and frequency responses of an arm that another program simulated, in one estimate."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from shaken_arm import TX90L, truth

import jointscope as js
from jointscope.factors.calibration import Calibration
from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.joint_kinds.calibrate_kinds import calibrate_kinds
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.graphs.poses.tracker_start import placed
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.robots.errors import SolveError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.bags.at_poses.read_shaken import read_shaken

ROOT = Path(__file__).parents[3]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not TX90L.is_dir(), reason="shared/data/tx90l is not beside the project"),
]


@pytest.fixture(scope="module")
def joint():
    robot = load_robot("tx90l")
    recordings = [read_shaken(TX90L / "frequency" / f"frequency_{p}", robot) for p in ("P1", "P3")]
    return calibrate_kinds(robot, recordings, [read_poses(TX90L / "poses_calibration", robot)])


def test_verification_poses_are_predicted(joint):
    _, (poses,) = placed(joint.robot, [read_poses(TX90L / "poses_verification", joint.robot)])
    mm = tip_errors(poses).to_json()
    assert mm["p90_mm"] < 0.055 and mm["max_mm"] < 0.11


def test_one_frequency_pose_leaves_the_tip_where_poses_have_it():
    robot = load_robot("tx90l")
    recordings = [read_shaken(TX90L / "frequency" / "frequency_P1", robot)]
    found = calibrate_kinds(robot, recordings, [read_poses(TX90L / "poses_calibration", robot)])
    _, (poses,) = placed(found.robot, [read_poses(TX90L / "poses_verification", robot)])
    mm = tip_errors(poses).to_json()
    assert mm["p90_mm"] < 0.055 and mm["max_mm"] < 0.11
    for name, true in truth("frequency").items():
        p = found.robot.parameters[name]
        assert abs(p.value - true) < 3.0 * p.sigma, name


def test_springs_and_dampers_are_right_within_their_sigmas(joint):
    for name, true in truth("frequency").items():
        p = joint.robot.parameters[name]
        assert abs(p.value - true) < 3.0 * p.sigma, name
        if name.endswith("stiffness"):
            assert abs(p.value / true - 1.0) < 0.01, name
        elif "stiffness" in name:
            assert abs(p.value / true - 1.0) < 0.02, name


def test_no_sigma_is_larger_than_that_of_the_same_poses_at_the_same_values(joint):
    problems = list(joint.poses.problems)
    states = tuple(p.start(Calibration.of(joint.robot))[0] for p in problems)
    solution = solve(problems, Estimate(states, joint.poses.calibrations), max_iterations=1)
    alone = np.sqrt(np.diag(posteriors(problems, solution)[1]))[: len(joint.poses.names)]
    ratio = np.sqrt(np.diag(joint.poses.covariance)) / alone
    assert ratio.max() < 1.01
    springs = [i for i, name in enumerate(joint.poses.names) if "stiffness" in name]
    assert ratio[springs].max() < 0.1


def test_both_kinds_agree_and_the_poses_pay_for_the_responses(joint):
    assert joint.agreement.dof > 10 and joint.agreement.p_value > 0.01
    alone, together = joint.pose_squares
    assert alone < together < 120.0
    assert not joint.poses.left_out


def test_the_graph_of_both_kinds_is_printed_on_one_screen(capsys, tmp_path, monkeypatch):
    for entry in TX90L.iterdir():
        (tmp_path / entry.name).symlink_to(entry)
    monkeypatch.chdir(tmp_path)
    code, printed = re.findall(
        r"<!-- executed by tests/graphs/joint_kinds/test_calibrate_kinds.py -->\n```python\n(.*?)```\n\n```\n(.*?)```",
        (ROOT / "docs/gtsam.md").read_text(encoding="utf-8"),
        re.DOTALL,
    )[0]
    exec(compile(code, "docs/gtsam.md", "exec"), {})
    said = capsys.readouterr().out
    assert said == printed
    assert len(said.splitlines()) < 40


def test_the_graph_of_both_kinds_has_the_values_and_sigmas_of_the_calibration(joint):
    g = js.graph(joint)
    sigmas, values = g.sigmas(g.values), g.parameters(g.optimize())
    assert set(values) == {n for n, p in joint.robot.parameters.items() if not p.fixed}
    for name, value in values.items():
        p = joint.robot.parameters[name]
        assert abs(value - p.value) < 0.02 * p.sigma, name
        assert sigmas[name] == pytest.approx(p.sigma, rel=1e-3), name


def test_the_graph_of_responses_alone_has_the_sigmas_of_their_calibration():
    robot = load_robot("tx90l")
    found = calibrate_frequency(robot, [read_shaken(TX90L / "frequency" / "frequency_P1", robot)])
    g = js.graph(found)
    sigmas = g.sigmas(g.values)
    assert all(sigmas[name] == pytest.approx(found.robot.parameters[name].sigma, rel=1e-2) for name in found.told)


def test_a_factor_for_every_sample_is_for_motion(joint):
    with pytest.raises(SolveError, match="takes recordings of motion only; leave it out"):
        js.graph(joint, per_sample=True)
