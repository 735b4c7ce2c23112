# SPDX-License-Identifier: BSD-3-Clause
"""A robot with free links in the one graph: its normal equations, sigmas, JSON and files are those of any robot."""

import json

import gtsam
import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.solving.batch_solver import solve
from jointscope.graphs.solving.condensed_graph import CondensedGraph
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.graphs.transmission.calibrate_links import calibrate_links
from jointscope.graphs.transmission.compare_links import compare_links
from jointscope.graphs.transmission.free_links import FreeLinks
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from tests.graphs.transmission.test_transmission import COMPLIANCE, arm

EFFECTS = (
    "joint_elasticity@joint1",
    "gyro_delay@imu2",
    "spring_cubic@joint1",
    "backlash@joint1",
    "encoder_delay@joint2",
)


@pytest.fixture(scope="module")
def robot():
    robot = load_robot("hebi_2r")
    for label in EFFECTS:
        robot = add_effect(robot, label)
    return robot.with_values({"joint1.joint_elasticity.compliance": 0.011, "joint1.spring_cubic.stiffness": 40.0})


@pytest.fixture(scope="module")
def solved():
    robot = load_robot("hebi_2r")
    for label in ("joint_elasticity@joint1", "joint_elasticity@joint2", "gyro_delay@imu2"):
        robot = add_effect(robot, label)
    problems = FreeLinks.of(robot, [arm(gyro_late=0.011), arm(gyro_late=0.011, seed=2)])
    starts = [problem.start(Calibration.of(problem.robot)) for problem in problems]
    start = Estimate(tuple(x for x, _ in starts), tuple(c for _, c in starts))
    return problems, solve(problems, start)


def test_the_gradient_is_that_of_the_cost_in_every_coordinate(robot):
    (problem,) = FreeLinks.of(robot, [arm()])
    x, calibration = problem.start(Calibration.of(problem.robot))
    system = problem.linearize(x, calibration)
    for block, place in calibration.columns.items():
        for k in range(place.stop - place.start):
            step = np.zeros(place.stop - place.start)
            step[k] = 1e-6
            there, back = (problem.linearize(x, calibration.retract({block: sign * step})).cost for sign in (1.0, -1.0))
            slope, size = (there - back) / 2e-6, np.sqrt(system.C[place.start + k, place.start + k] * system.cost)
            assert system.g_p[place.start + k] == pytest.approx(slope, abs=1e-3 * size), (block, k)


def test_sigmas_are_those_of_gtsam(solved):
    problems, solution = solved
    _, covariance = posteriors(problems, solution)
    graph, values = CondensedGraph.of(problems, solution.estimate, (), 0)
    marginals = gtsam.Marginals(graph.graph, values)
    block = solution.estimate.calibrations[0].layout["dynamics"]
    place = solution.shared.columns["dynamics"]
    expected = np.sqrt(np.diag(marginals.marginalCovariance(block.key())))
    np.testing.assert_allclose(np.sqrt(np.diag(covariance))[place], expected, rtol=1e-4)


def test_parameters_that_no_equation_has_stay_as_they_are(solved):
    problems, _ = solved
    assert problems[0].robot.parameters["joint1.joint_elasticity.damping"].fixed
    assert not problems[0].robot.parameters["joint1.joint_elasticity.compliance"].fixed


def test_a_calibration_has_the_json_of_every_calibration():
    robot = add_effect(add_effect(load_robot("hebi_2r"), "joint_elasticity@joint1"), "joint_elasticity@joint2")
    result = calibrate_links(robot, [arm(), arm(seed=2)])
    content = json.loads(json.dumps(result.to_json()))
    assert content["converged"] and content["channels"]["joint1.gear"]["chi2"] < 1.0
    found = content["parameters"]["joint1.joint_elasticity.compliance"]
    assert abs(found["value"] - COMPLIANCE[0]) < 5.0 * found["sigma"]
    assert found["sigma"] < 0.01 * COMPLIANCE[0]
    assert result.robot.parameters["joint1.joint_elasticity.compliance"].sigma == found["sigma"]


def test_models_are_compared_on_zeros_and_biases_of_the_recording_itself():
    rigid = load_robot("hebi_2r")
    soft = add_effect(rigid, "joint_elasticity@joint1", {"compliance": float(COMPLIANCE[0])})
    result = compare_links({"rigid": rigid, "soft": soft}, arm(seed=4))
    before, after = (model.channels["joint1.gear"] for model in result.models)
    assert after.horizons["open_loop"] < 0.1 * before.horizons["open_loop"]
    assert set(before.horizons) == {"0.01", "0.1", "1.0", "open_loop"}
    assert result.models[1].error < result.models[0].error
