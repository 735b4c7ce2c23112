# SPDX-License-Identifier: BSD-3-Clause
"""Frequency responses and motion of one arm in one estimate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken_arm import made_up
from three_axes import geometry_in_doubt, record, three_axes
from weighed_springs import WeighedSprings

import jointscope as js
from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.frequency.frequency_summary import FrequencySummary
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage, next_stage
from jointscope.graphs.joint_kinds.beside_motion import responses_agree
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.at_poses.read_shaken import read_shaken
from jointscope.tools.verdicts.judgement import judge

pytest.importorskip("mujoco", reason="arms are moved by MuJoCo, which the extra `sim` brings")
DRIVES = [f"joint{j}.stiffness" for j in (1, 2, 3)]


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    """Folder of the recordings, true values, the motion alone, the responses alone, and both."""
    folder = tmp_path_factory.mktemp("three_axes")
    truth = record(folder)
    robot, bags = three_axes(folder), [folder / "both" / f"frequency_{k}.mcap" for k in (1, 2)]
    motion = js.calibrate(robot, folder / "moves.mcap")
    responses = calibrate_frequency(robot, [read_shaken(bag, robot) for bag in bags])
    return folder, truth, motion, responses, js.calibrate(robot, folder / "moves.mcap", frequency=bags)


@pytest.mark.slow
def test_one_estimate_has_smaller_sigmas_than_either_kind_and_holds_the_truth(kinds):
    _, truth, motion, responses, both = kinds
    for name in DRIVES:
        p, alone = both[name], (motion[name].sigma, responses.robot.parameters[name].sigma)
        assert p.sigma < 0.95 * min(alone), name
    for name, true in truth.items():
        if not both.robot.parameters[name].fixed:
            assert abs(both[name].value - true) < 3.0 * both[name].sigma, name
            assert both[name].sigma < 1.05 * motion[name].sigma, name
    assert both.samples == motion.samples + sum(problem.measured for problem in responses.problems)


@pytest.mark.slow
def test_both_kinds_agree_and_the_robot_file_says_what_was_used(kinds, tmp_path):
    both = kinds[-1]
    found = responses_agree(both)
    assert found.dof >= 6 and found.p_value > 0.01
    assert judge(both).level == "good"
    both.save(tmp_path / "both.yaml")
    assert "frequency_2.mcap" in (tmp_path / "both.yaml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_graph_of_both_holds_the_responses_as_a_factor(kinds):
    both = kinds[-1]
    g = js.graph(both)
    found, sigmas = g.parameters(g.optimize()), g.sigmas(g.values)
    for name in DRIVES:
        assert found[name] == pytest.approx(both[name].value, abs=0.05 * both[name].sigma)
        assert sigmas[name] == pytest.approx(both[name].sigma / both.sigma_inflation[name], rel=1e-2)


@pytest.mark.slow
def test_a_third_kind_adds_what_it_knows(kinds):
    folder, truth, _, _, both = kinds
    robot, bags = three_axes(folder), [folder / "both" / f"frequency_{k}.mcap" for k in (1, 2)]
    true = truth["joint2.stiffness"]
    torques, sigma = np.linspace(-100.0, 300.0, 10), 1e-8
    dial = torques / true + 2e-3 + sigma * np.random.default_rng(0).standard_normal(10)
    weights = WeighedSprings(robot, "joint2", torques, dial, (sigma, sigma))
    three = js.calibrate(robot, folder / "moves.mcap", frequency=bags, sets=[weights])
    own = sigma * true**2 / np.linalg.norm(torques - torques.mean())
    expected = (both["joint2.stiffness"].sigma ** -2 + own**-2) ** -0.5
    assert three["joint2.stiffness"].sigma == pytest.approx(expected, rel=0.1)
    assert abs(three["joint2.stiffness"].value - true) < 3.0 * three["joint2.stiffness"].sigma


@pytest.mark.slow
def test_a_drive_that_is_softer_in_the_motion_is_a_contradiction(tmp_path):
    record(tmp_path, seconds=5.0, softer=1.03)
    bags = [tmp_path / "both" / f"frequency_{k}.mcap" for k in (1, 2)]
    both = js.calibrate(three_axes(tmp_path), tmp_path / "moves.mcap", frequency=bags)
    assert responses_agree(both).doubtful
    (check,) = [c for c in judge(both).checks if c.name == "Kinds that agree on the values"]
    assert check.level == "bad" and "contradict each other" in check.text


@pytest.mark.slow
def test_an_arm_whose_geometry_is_off_is_no_contradiction_where_its_file_says_that_it_may_be(tmp_path):
    truth = record(tmp_path, perfect=False)
    bags = [tmp_path / "both" / f"frequency_{k}.mcap" for k in (1, 2)]
    both = js.calibrate(geometry_in_doubt(tmp_path), tmp_path / "moves.mcap", frequency=bags)
    assert responses_agree(both).p_value > 0.01
    for name in DRIVES:
        assert abs(both[name].value - truth[name]) < 3.0 * both[name].sigma, name
        assert abs(both[name].value / truth[name] - 1.0) < 3e-4, name
    both.save(tmp_path / "found.yaml", report=tmp_path / "found.html")
    page = (tmp_path / "found.html").read_text(encoding="utf-8")
    assert page.count("Response in") >= 2 and "Motion and frequency responses agree" in page


@pytest.fixture(scope="module")
def summary():
    robot = load_robot("tx90l")
    first = first_stage(robot, ShakenPose.of(*made_up()))
    at = first.start(Calibration.of(robot))[1]
    return FrequencySummary.of([next_stage(first, at)], at)


def test_a_factor_of_responses_finds_its_values_by_name_in_a_robot_that_has_more(summary):
    robot = load_robot("tx90l")
    more = replace(robot.parameters["joint1.inertia"], fixed=False)
    other = replace(
        robot, parameters={"joint1.inertia": more, **{n: p for n, p in robot.parameters.items() if n != more.name}}
    )
    calibration = Calibration.of(other).only([DYNAMICS])
    assert calibration.names[0] == "joint1.inertia" and more.name not in summary.names
    found = summary.of_robot(other).linearize(np.zeros((0, 1)), calibration)
    own = summary.linearize(np.zeros((0, 1)), Calibration.of(robot).only([DYNAMICS]))
    assert found.cost == pytest.approx(own.cost) and not found.C[0].any()
    np.testing.assert_allclose(found.C[1:, 1:], own.C)
    np.testing.assert_allclose(found.g_p[1:], own.g_p)


def test_without_friction_springs_keep_their_sigmas_and_friction_has_none(summary):
    less = summary.without_friction()
    prior = np.diag([1e-6] * len(summary.names))  # hardly anything, for what the responses do not tell
    dry = np.array([name.endswith(("coulomb_torque", "friction_sharpness")) for name in summary.names])
    covariance = [np.linalg.inv(one.information + prior) for one in (summary, less)]
    told = np.sqrt(np.diag(covariance[0])) < 0.1
    np.testing.assert_allclose(np.diag(covariance[1])[told & ~dry], np.diag(covariance[0])[told & ~dry], rtol=1e-3)
    assert dry.sum() == 6 and not less.information[dry].any()
