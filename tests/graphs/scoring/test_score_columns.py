# SPDX-License-Identifier: BSD-3-Clause
"""Every regressor against the numerical derivative of the residuals of the model that really has the effect.

This catches wrong signs, owners, equations and units. Bearings and springs of rigid joints bring coordinates along that
a derivative at null does not have, and the play of an encoder has none there; they have tests of their own.
"""

from __future__ import annotations

import numpy as np
import pytest
from linearised_motion import base, one_hypothesis_each, regressors, residuals

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect

SMALL = 1e-4  # of the example size
TRAPEZOID = 0.03  # relative difference between the two rules along this motion
SLIGHT = 0.1  # of the largest change: equations that change less are held against that

QUASI_STATIC = ("bearing_flexibility", "joint_elasticity")
FOLLOWED = ("encoder_hysteresis",)
CASES = [case for case in one_hypothesis_each("doggy") if case[1].here.effect.id not in QUASI_STATIC + FOLLOWED]
CASES += one_hypothesis_each("without Coriolis terms", ("coriolis",))
OTHERS = ("motor_viscous", "torque_offset", "motor_lag", "link_viscous", "gravity_imbalance", "kinematic_coupling")
OTHERS += ("inertia_error", "gyro_scale", "gyro_delay", "encoder_delay", "encoder_eccentricity")
CASES += one_hypothesis_each("joint 2 rigid", OTHERS)
CASES += one_hypothesis_each("accelerometer", ("motor_viscous", "link_viscous", "payload", "gyro_delay", "gyro_scale"))
CASES += one_hypothesis_each("target", ("motor_viscous", "link_viscous", "payload", "gyro_delay", "clock_offset"))
CASES += one_hypothesis_each(
    "soft bearing", (*OTHERS, "spring_cubic", "payload", "load_dependent_friction", "hysteresis")
)
CASES += one_hypothesis_each("heavy", ("weight_dependent_friction", "gravity_direction"))
CASES += one_hypothesis_each("heavy, without gyros", ("axis_misalignment",))
CASES += one_hypothesis_each("known drives", ("torque_constant_error",))


def test_every_effect_has_a_case():
    tested = {hypothesis.here.effect.id for _, hypothesis in CASES} | set(QUASI_STATIC + FOLLOWED)
    assert set(catalogue()) - tested == {
        "integration_error",
        "load_scale",
    }  # one has no parameter, and a test below; one acts at rest


@pytest.mark.parametrize("name, hypothesis", CASES, ids=[f"{hypothesis.label} ({name})" for name, hypothesis in CASES])
def test_a_regressor_is_the_derivative_of_the_residuals(name, hypothesis):
    segment, x = base(name)
    columns, without = regressors(segment, hypothesis), residuals(segment.problem, x, segment.calibration)
    seen = []
    for k, size in enumerate(hypothesis.sizes):
        amount = SMALL * abs(hypothesis.here.effect.example[size.name])
        sizes = {s.name: amount if s is size else s.null for s in hypothesis.sizes}
        robot = add_effect(segment.problem.robot, hypothesis.label, {**sizes, **hypothesis.shapes})
        problem = BagProblem.of(robot, segment.problem.recording)
        states, calibration = robot.layout.carried_over(x, segment.problem.robot.layout), Calibration.of(robot)
        if robot.layout.memories:
            states = with_memory(problem, states, calibration)
        changed = residuals(problem, states, calibration)
        pairs = []
        for row, before in without.items():
            derivative = (changed[row] - before) / amount
            column = columns[row][:, k] if row in columns else np.zeros(len(before))
            inside = np.isfinite(derivative)
            assert np.mean(inside) > 0.98
            pairs.append((row, derivative[inside], column[inside]))
        largest = max(np.linalg.norm(derivative) for _, derivative, _ in pairs)
        seen.append(largest > 0.0)
        for row, derivative, column in pairs:
            allowed = TRAPEZOID * max(np.linalg.norm(derivative), SLIGHT * largest, 1e-6)
            off = np.linalg.norm(derivative - column)
            assert off <= allowed, f"{size.name} in {row}: off by {off / max(np.linalg.norm(derivative), 1e-300):.3g}"
    assert any(seen), "no size changes any residual"


@pytest.mark.parametrize("joint", ["joint1", "joint2", "joint3"])
def test_the_regressor_of_a_play_is_what_its_encoder_misses_of_it(joint):
    """Turned by hand: the reading stands until the play is gone through, and then trails by half of it."""
    segment, x = base("doggy")
    hypothesis = next(h for _, h in one_hypothesis_each("doggy", FOLLOWED) if h.here.owner == joint)
    robot, columns = segment.problem.robot, regressors(segment, hypothesis)
    j = robot.joints.index(joint)
    half = 2.0 * robot.motor_encoder.sigmas[j]
    q, misses, read = x[:, robot.layout.motor_q[j]], [], x[0, robot.layout.motor_q[j]]
    for turned in q:
        read = min(max(read, turned - half), turned + half)
        misses.append((read - turned) / half)
    (row,) = [row for row in columns if row.startswith("motor_encoder") and joint in row]
    seen = columns[row][:, 0]
    at = np.linspace(0, len(misses) - 1, len(seen)).round().astype(int)
    assert np.corrcoef(seen, np.asarray(misses)[at])[0, 1] > 0.99
    assert all(not np.any(other[:, 0]) for name, other in columns.items() if name != row)


def test_the_regressor_of_the_integration_error_is_what_the_better_rule_changes():
    segment, x = base("Euler")
    ((_, hypothesis),) = one_hypothesis_each("Euler", ("integration_error",))
    columns, without = regressors(segment, hypothesis), residuals(segment.problem, x, segment.calibration)
    better = BagProblem.of(add_effect(segment.problem.robot, hypothesis.label), segment.problem.recording)
    changed = residuals(better, x, segment.calibration)
    for row, before in without.items():
        column = columns[row][:, 0] if row in columns else np.zeros(len(before))
        np.testing.assert_allclose(column, changed[row] - before, rtol=1e-9, atol=1e-9, err_msg=row)


def with_memory(problem, x, calibration):
    """The states with the memories of effects integrated along the motion, by Heun's rule."""
    layout, h = problem.robot.layout, problem.timeline.h
    full, values = x.copy(), calibration.values
    model, u = problem.dynamics.model, problem.dynamics.command(values)
    for k in range(len(h)):
        here, ahead = full[k : k + 1], full[k + 1 : k + 2].copy()
        first = model.accelerations(here, u[k : k + 1], values)[:, -1]
        ahead[:, layout.memory] = here[:, layout.memory] + h[k] * first
        last = model.accelerations(ahead, u[k : k + 1], values)[:, -1]
        full[k + 1, layout.memory] = here[0, layout.memory] + 0.5 * h[k] * (first + last)
    return full
