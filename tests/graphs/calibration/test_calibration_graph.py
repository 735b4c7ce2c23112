# SPDX-License-Identifier: BSD-3-Clause
"""The graph of a calibration in the hands of a user: print it, add to it, solve it with GTSAM."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.calibration_graph import CalibrationGraph
from jointscope.robots.errors import SolveError


@pytest.fixture(scope="module")
def calibrated(simulated, doggy):
    """A calibration of two seconds in motion."""
    return calibrate(doggy, [simulated.recording.between(4.0, 6.0)])


def _about(name, graph, value, sigma):
    """A user's factor: a data sheet says what a parameter is, give or take a share of it."""
    i = graph.coordinate(name)

    def error(this, values, H):
        dynamics = values.atVector(graph.keys["dynamics"])
        if H is not None:
            H[0] = np.asfortranarray(np.eye(len(dynamics))[i : i + 1])
        return dynamics[i : i + 1] - np.log(value)

    return gtsam.CustomFactor(gtsam.noiseModel.Isotropic.Sigma(1, sigma), [graph.keys["dynamics"]], error)


def test_the_graph_of_a_calibration_is_printed_on_one_screen(calibrated):
    text = CalibrationGraph.of(calibrated).describe()
    assert len(text.splitlines()) < 12
    assert "dynamics, imu1.rotation, imu2.rotation, imu1.bias, imu2.bias" in text


def test_gtsams_optimizer_stays_where_the_calibration_ended(calibrated):
    graph = CalibrationGraph.of(calibrated)
    found = graph.parameters(graph.optimize())
    for parameter in calibrated.parameters:
        if parameter.name in found:
            assert found[parameter.name] == pytest.approx(parameter.value, abs=1e-3 * parameter.sigma)


@pytest.mark.slow
@pytest.mark.parametrize("per_sample", [False, True], ids=["condensed", "a factor per sample"])
def test_gtsams_marginals_are_the_sigmas_of_the_calibration(calibrated, per_sample):
    graph = CalibrationGraph.of(calibrated, per_sample)
    sigmas = graph.sigmas(graph.values)
    for parameter in calibrated.parameters:
        if parameter.name in sigmas:
            plain = parameter.sigma / calibrated.sigma_inflation[parameter.name]
            assert sigmas[parameter.name] == pytest.approx(plain, rel=1e-4)


@pytest.mark.parametrize("states", ["with states", "states eliminated"])
def test_a_users_factor_moves_its_parameter_as_the_covariance_says(calibrated, states):
    graph = CalibrationGraph.of(calibrated)
    name, sigmas = "joint2.stiffness", graph.sigmas(graph.values)
    value = graph.parameters(graph.values)[name]
    mine = sigmas[name] / value  # a data sheet as sure as the recording, one percent higher
    factor = _about(name, graph, 1.001 * value, mine)
    if states == "with states":
        graph.graph.add(factor)
        found = graph.parameters(graph.optimize())
    else:
        linear, shared = graph.without_states()
        linear.add(factor)
        found = graph.parameters(gtsam.LevenbergMarquardtOptimizer(linear, shared).optimize())
    assert np.log(found[name] / value) == pytest.approx(0.5 * np.log(1.001), rel=0.05)


def test_condensed_and_plain_factors_cost_the_same(calibrated):
    condensed = CalibrationGraph.of(calibrated)
    plain = CalibrationGraph.of(calibrated, per_sample=True)
    assert condensed.graph.error(condensed.values) == pytest.approx(plain.graph.error(plain.values), rel=1e-9)
    assert condensed.graph.size() < 12 < 2000 < plain.graph.size()


def test_a_factor_with_a_key_that_the_graph_lacks_is_an_error(calibrated):
    graph = CalibrationGraph.of(calibrated)
    graph.graph.add(gtsam.PriorFactorVector(gtsam.symbol("q", 7), np.zeros(2), gtsam.noiseModel.Unit.Create(2)))
    with pytest.raises(SolveError, match=r"touches q7, which the graph's values lack; insert a start value.*dynamics"):
        graph.optimize()
    for work in (lambda: graph.sigmas(graph.values), graph.without_states):
        with pytest.raises(SolveError, match="which the graph's values lack"):
            work()


def test_a_parameter_that_is_not_free_is_an_error(calibrated):
    with pytest.raises(SolveError, match=r"no free parameter 'joint9.stiffness' in the graph; it has motor.k_pwm"):
        CalibrationGraph.of(calibrated).coordinate("joint9.stiffness")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_users_factor_without_a_finite_error_is_named(calibrated, value):
    graph = CalibrationGraph.of(calibrated)
    graph.graph.add(_about("joint1.stiffness", graph, value, 0.01))
    last = graph.graph.size() - 1
    for ask in (graph.optimize, graph.without_states):
        with pytest.raises(SolveError, match=rf"^factor {last} on .* expected a finite one"):
            ask()


def _shaped(key, rows, columns, error=0.0, failing=""):
    """A user's factor with a mistake: a Jacobian of some shape, or a function that fails."""

    def work(this, values, H):
        if failing:
            raise ValueError(failing)
        if H is not None:
            H[0] = np.asfortranarray(np.ones((rows, columns)))
        return np.full(1, error)

    return gtsam.CustomFactor(gtsam.noiseModel.Isotropic.Sigma(1, 1.0), [key], work)


@pytest.mark.parametrize(
    ("block", "factor", "said"),
    [
        ("dynamics", lambda k: _shaped(k, 1, 3), r"Jacobian H\[0\] of shape \(1, 3\) by dynamics; expected \(1, 12\)"),
        ("imu1.rotation", lambda k: _shaped(k, 1, 9), r"of shape \(1, 9\) by imu1.rotation; expected \(1, 3\)"),
        (
            "dynamics",
            lambda k: _shaped(k, 1, 12, failing="my bug"),
            r"cannot be evaluated \(ValueError: my bug\); correct",
        ),
        (
            "imu1.rotation",
            lambda k: gtsam.PriorFactorVector(k, np.zeros(3), gtsam.noiseModel.Unit.Create(3)),
            r"cannot be evaluated \(RuntimeError: Attempting to retrieve value with key \"r0\"",
        ),
    ],
)
def test_a_users_factor_that_does_not_fit_its_variable_is_named(calibrated, block, factor, said):
    graph = CalibrationGraph.of(calibrated)
    graph.graph.add(factor(graph.keys[block]))
    for ask in (graph.optimize, graph.without_states, lambda: graph.sigmas(graph.values)):
        with pytest.raises(SolveError, match=rf"^factor {graph.own} on .*{said}"):
            ask()


def test_a_variable_that_nothing_determines_is_named(calibrated):
    graph = CalibrationGraph.of(calibrated)
    graph.values.insert(gtsam.symbol("q", 7), np.zeros(2))
    first = gtsam.PriorFactorVector(
        gtsam.symbol("q", 7), np.zeros(2), gtsam.noiseModel.Diagonal.Precisions(np.eye(2)[0])
    )
    graph.graph.add(first)
    with pytest.raises(SolveError, match=r"nothing determines q7 \(q7\) where it was eliminated; add a factor on it"):
        graph.sigmas(graph.values)


def test_a_name_that_is_no_variable_is_told_with_those_that_are(calibrated):
    with pytest.raises(SolveError, match=r"no variable 'imu9.bias' in the graph; it has dynamics, imu1.rotation"):
        CalibrationGraph.of(calibrated).keys["imu9.bias"]


def test_an_error_depends_on_the_values_alone_and_not_on_what_was_asked_before(calibrated):
    """Inner states that follow by one linear step from where they were differ where friction reverses, by 3e-4."""
    graph, rng = CalibrationGraph.of(calibrated), np.random.default_rng(1)

    def moved():
        values, key = gtsam.Values(graph.values), graph.keys["dynamics"]
        here = values.atVector(key)
        values.update(key, here + 0.01 * rng.standard_normal(len(here)))
        return values

    here, there = moved(), moved()
    at_start = graph.graph.error(graph.values)
    first = graph.graph.error(here)
    graph.graph.linearize(there)
    assert graph.graph.error(here) == first
    assert graph.graph.error(graph.values) == at_start


@pytest.mark.parametrize("by", ["joint2.stiffness", "motor.inertia"])
def test_an_error_is_the_same_after_a_look_far_away(calibrated, by):
    """Inner states that follow from there would have run away for good."""
    graph = CalibrationGraph.of(calibrated)
    key, at_start = graph.keys["dynamics"], graph.graph.error(graph.values)
    errors = []
    for change in (0.5, 0.01, 0.5):
        values, here = gtsam.Values(graph.values), graph.values.atVector(graph.keys["dynamics"]).copy()
        here[graph.coordinate(by)] += change
        values.update(key, here)
        errors.append(graph.graph.error(values))
    assert errors[0] == errors[2] > errors[1] > at_start == graph.graph.error(graph.values)


def _stiff(key, column, factor=1.0, size=12):
    """Says the first value of a block, with a derivative by `column`, times a factor."""

    def work(this, values, H):
        if H is not None:
            H[0] = np.asfortranarray(factor * np.eye(size)[[column]])
        return values.atVector(key)[:1] - 1.0

    return gtsam.CustomFactor(gtsam.noiseModel.Isotropic.Sigma(1, 1.0), [key], work)


@pytest.mark.parametrize(("column", "factor"), [(0, -1.0), (1, 1.0), (0, 0.1), (0, 0.0)])
def test_a_jacobian_that_is_not_the_derivative_is_named(calibrated, column, factor):
    graph = CalibrationGraph.of(calibrated)
    graph.graph.add(_stiff(graph.keys["dynamics"], column, factor))
    with pytest.raises(SolveError, match=r"H\[0\] by dynamics that is not the derivative of its error: .* % off"):
        graph.optimize()
    right = CalibrationGraph.of(calibrated)
    right.graph.add(_stiff(right.keys["dynamics"], 0))
    assert right.graph.error(right.optimize()) < right.graph.error(right.values)
