# SPDX-License-Identifier: BSD-3-Clause
"""Sigmas of friction hold, wherever in their bands motors stand; a bench whose equilibria are worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from lever_bench import C0, C1, hanging, lever

from jointscope.graphs.rests.band_posterior import MotorBands, _moments
from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.robots.errors import SolveError
from jointscope.tools.verdicts.rests.rest_verdict import verdict

TRUTH = {"swing.coulomb_torque": C0, "swing.weight_dependent_friction.coefficient": C1}


def off(result):
    """Friction less its truth, in sigmas."""
    found = {p.name: p for p in result.parameters}
    return np.array([(found[name].value - true) / found[name].sigma for name, true in TRUTH.items()])


@pytest.mark.slow
@pytest.mark.parametrize("count", (15, 40))
def test_two_sigma_hold_the_friction_of_motors_that_stick_anywhere(tmp_path, count):
    robot = lever(tmp_path)
    results = [calibrate_rests(robot, [hanging(count, 500 + seed)]) for seed in range(100)]
    inside = np.mean([np.abs(off(result)) < 2.0 for result in results], axis=0)
    assert np.all(inside > 0.87) and np.all(inside < 0.995)  # 0.95 expected, 0.02 sigma of the share
    assert not any("friction" in verdict(result) for result in results if verdict(result).startswith("No"))


def edges(count, seed, lost=0.0):
    """Rests of motors that slid to where they rest and lost up to a share of their friction since."""
    rests, rng = hanging(count, seed, creeping=count), np.random.default_rng(seed)
    load = 2.0 * 9.81 * 0.3 * np.sin(rests.q_link) + rests.forces[:, :1] * 0.5 * np.cos(rests.q_link)
    direction = np.sign(rests.creep)
    friction = (C0 + C1 * np.abs(load)) * direction * (1.0 - lost * rng.random((count, 1)))
    return replace(rests, u=load + friction, creep=0.0 * rests.creep)


@pytest.mark.parametrize("lost", (0.0, 0.1))
def test_motors_that_all_slid_to_where_they_rest_have_the_friction_at_the_edge(tmp_path, lost):
    result = calibrate_rests(lever(tmp_path), [edges(40, 11, lost)])
    found = {p.name: p.value for p in result.parameters}
    load = np.linspace(0.0, 6.0, 7)
    size = found["swing.coulomb_torque"] + found["swing.weight_dependent_friction.coefficient"] * load
    np.testing.assert_allclose(size, C0 + C1 * load, rtol=0.06)
    assert np.all(np.abs(off(result)) < 2.5)


@pytest.mark.parametrize("start", (0.01, 20.0))
def test_bands_that_begin_far_too_wide_or_narrow_come_to_the_same_end(tmp_path, start):
    robot = lever(tmp_path)
    near, far = (
        calibrate_rests(r, [hanging(40, 1)]) for r in (robot, robot.with_values({"swing.coulomb_torque": start}))
    )
    for a, b in zip(near.parameters, far.parameters, strict=True):
        assert abs(a.value - b.value) < 0.2 * a.sigma, a.name


def test_a_band_that_closes_at_a_rest_is_told_and_not_waited_for():
    one, nothing = np.ones(3), np.zeros((3, 1))
    half = np.array([1.0, 1.0, -0.1])
    closed = MotorBands(
        0.1 * one,
        half,
        one,
        one,
        0.0 * one,
        one[:, None],
        nothing,
        np.eye(1),
        np.zeros(1),
        np.zeros(1),
        np.zeros((0, 1)),
        np.zeros(0),
        np.eye(1),
    )
    with pytest.raises(SolveError, match="a friction band closes at one of its 3 rests"):
        closed.moments(np.zeros(1))


def test_values_without_a_covariance_are_told_and_no_bug():
    with pytest.raises(SolveError, match="no covariance where they are likeliest: the model contradicts the rests"):
        _moments(SimpleNamespace(A=np.array([[1.0, 2.0], [2.0, 1.0]])), np.zeros(2))


def test_friction_of_motors_that_creep_as_their_speed_says_is_no_yes(tmp_path):
    rests, rng = hanging(40, 6, creeping=30), np.random.default_rng(2)
    assert not verdict(calibrate_rests(lever(tmp_path), [rests])).startswith("No")
    slides = rests.creep != 0.0
    load = 2.0 * 9.81 * 0.3 * np.sin(rests.q_link) + rests.forces[:, :1] * 0.5 * np.cos(rests.q_link)
    share = rng.uniform(0.4, 1.0, (40, 1))
    weak = load + (C0 + C1 * np.abs(load)) * np.sign(rests.creep) * share
    said = verdict(calibrate_rests(lever(tmp_path), [replace(rests, u=np.where(slides, weak, rests.u))]))
    assert said.startswith("No") and "friction of swing" in said
