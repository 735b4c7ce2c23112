# SPDX-License-Identifier: BSD-3-Clause
"""Regressors of effects that bring coordinates along, against the equilibrium of the model that has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linearised_motion import base, one_hypothesis_each, regressors, residuals

from jointscope.factors.calibration import Calibration
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_editing import add_effect

BEARING = {"frequency": 150.0, "damping_ratio": 0.3}  # resonance far above the motion: tilts follow the torque at once
SOFT, HARD = 1e-7, 1e-11  # [rad/(N m)]
LAG, NEGLECTED = 0.03, 0.25  # of the resonance; inertias and Coriolis torques that change with the tilt
FELT = 0.05  # of the resonance on accelerations, which have more of what is fast


def test_a_rigid_joint_that_becomes_elastic_leads_its_link_by_compliance_times_torque():
    """With motors that run ahead as the regressor says, the spring accelerates the links as the rigid joint did."""
    segment, x = base("joint 2 rigid")
    (hypothesis,) = [hypothesis for _, hypothesis in one_hypothesis_each("joint 2 rigid", ("joint_elasticity",))]
    columns, sigma = regressors(segment, hypothesis), segment.problem.robot.motor_encoder.sigmas[0]
    lead = sigma * columns["motor_encoder joint2.motor_position"][:, 0]
    compliance, count = 1e-9, len(lead)
    robot = add_effect(segment.problem.robot, hypothesis.label, {"compliance": compliance, "damping": 1e-3})
    x, u = x[:count], segment.problem.timeline.u[:count]
    soft = robot.layout.carried_over(x, segment.problem.robot.layout)
    soft[:, robot.layout.motor_q[1]] += compliance * lead
    a_rigid = segment.problem.dynamics.model.accelerations(x, u, segment.calibration.values)[:, :3]
    a_soft = ElasticJoints(robot).accelerations(soft, u, Calibration.of(robot).values)[:, :3]
    np.testing.assert_allclose(a_soft, a_rigid, atol=1e-4 * np.abs(a_rigid).max())
    for row, column in columns.items():
        assert row == "motor_encoder joint2.motor_position" or not np.any(column), row


@pytest.mark.parametrize("axis", "xy")
@pytest.mark.parametrize("joint", ("joint1", "joint2"))
@pytest.mark.parametrize("name", ("doggy", "accelerometer", "target"))
def test_a_soft_bearing_tilts_as_its_hinges_do_in_equilibrium(name, joint, axis):
    """Tilts that leave the hinges of the real model without acceleration, put into its residuals; small motion."""
    segment, x = base(name, amplitude=0.04, posture=0.5)
    (hypothesis,) = [
        hypothesis
        for _, hypothesis in one_hypothesis_each(name, ("bearing_flexibility",))
        if hypothesis.here.owner == joint
    ]
    columns = regressors(segment, replace(hypothesis, shapes=BEARING))
    start = {f"compliance_{a}": SOFT if a == axis else HARD for a in "xy"}
    robot = add_effect(segment.problem.robot, hypothesis.label, start | {"damping_x": 1e-6, "damping_y": 1e-6})
    problem, layout, calibration = BagProblem.of(robot, segment.problem.recording), robot.layout, Calibration.of(robot)
    soft = layout.carried_over(x, segment.problem.robot.layout)
    tilt_in_equilibrium(problem, soft, [layout.links.index(f"{joint}.bearing_{a}") for a in "xy"], calibration)
    before, after = residuals(segment.problem, x, segment.calibration), residuals(problem, soft, calibration)
    scale, scale_soft = impulses(segment.problem), impulses(problem)
    k, inside = "xy".index(axis), slice(100, -100)
    links = [row for row in before if row.endswith(".link_velocity")]
    gyros, felt, placed = ([row for row in before if row.startswith(kind)] for kind in ("imu", "acc", "target"))
    assert len(felt) == 3 * (name == "accelerometer") and len(placed) == 3 * (name == "target")
    for group, allowed in ((links, NEGLECTED), (gyros, LAG), (felt, FELT), (placed, LAG)):
        pairs = []
        for row in group:
            size, size_soft = scale.get(row, np.ones(len(before[row]))), scale_soft.get(row, np.ones(len(before[row])))
            change = (after[row] * size_soft - before[row] * size) / SOFT
            pairs.append((row, change[inside], columns[row][inside, k] * size[inside]))
        largest = max((np.linalg.norm(change) for _, change, _ in pairs), default=0.0)
        for row, change, column in pairs:
            off = np.linalg.norm(change - column) / max(np.linalg.norm(change), 0.1 * largest, 1e-300)
            assert off < allowed, f"{row}: off by {off:.3g}"


def tilt_in_equilibrium(problem, x, hinges, calibration):
    """Sets the hinges of all states so that they do not accelerate, and their velocities to the derivative."""
    model, ticks = problem.dynamics.model, problem.timeline.ticks
    u = np.vstack([problem.timeline.u, problem.timeline.u[-1:]])
    at_zero = model.accelerations(x, u, calibration.values)[:, hinges]
    slopes = []
    for hinge in hinges:
        moved = x.copy()
        moved[:, hinge] += 1e-9
        slopes.append((model.accelerations(moved, u, calibration.values)[:, hinges] - at_zero) / 1e-9)
    tilt = -np.linalg.solve(np.stack(slopes, axis=2), at_zero[:, :, None])[:, :, 0]
    x[:, hinges] = tilt
    x[:, [problem.robot.layout.n_link + hinge for hinge in hinges]] = np.gradient(tilt, ticks, axis=0)


def impulses(problem):
    """Factors from whitened residuals to impulses [N m s], by link equation."""
    tree, layout = problem.robot.kinematic_tree, problem.robot.layout
    alone = 1.0 / np.diag(np.linalg.inv(tree.mass_matrix(np.zeros((1, layout.n_link)))[0]))
    sigmas = problem.dynamics.sigmas
    return {f"{name}.link_velocity": sigmas[:, i] * alone[i] for i, name in enumerate(layout.links)}
