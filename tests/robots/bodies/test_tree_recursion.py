# SPDX-License-Identifier: BSD-3-Clause
"""The compiled recursions over the joints against pinocchio, sample by sample."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.bodies.equations_of_motion import FreeEquations


def _random_tree(n: int, seed: int) -> pin.Model:
    """Branches of joints that turn or slide about slanted axes, with rotors and slanted gravity."""
    rng, model = np.random.default_rng(seed), pin.Model()
    pin.seed(seed)
    model.gravity = pin.Motion(np.array([0.4, 0.3, -9.81]), np.zeros(3))
    branch = [0]
    for i in range(n):
        while len(branch) > 1 and rng.random() < 0.3:
            branch.pop()
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        turns = rng.random() < 0.7
        joint = pin.JointModelRevoluteUnaligned(axis) if turns else pin.JointModelPrismaticUnaligned(axis)
        branch.append(model.addJoint(branch[-1], joint, pin.SE3.Random(), f"joint{i}"))
        model.appendBodyToJoint(branch[-1], pin.Inertia.Random(), pin.SE3.Random())
    model.armature = rng.uniform(0.0, 1.0, n)
    return model


@pytest.mark.parametrize(("n", "seed"), [(1, 1), (3, 2), (6, 3), (12, 4)])
def test_accelerations_and_derivatives_equal_pinocchios(n, seed):
    model = _random_tree(n, seed)
    data, equations = model.createData(), FreeEquations(model)
    q, v, tau = np.random.default_rng(seed).normal(size=(3, 20, n)) * np.array([2.0, 3.0, 20.0])[:, None, None]
    a, by_q, by_v, M_inverse = equations.derivatives(q, v, tau)
    np.testing.assert_array_equal(equations.acceleration(q, v, tau), a)
    for k in range(len(q)):
        wanted = [part.copy() for part in pin.computeABADerivatives(model, data, q[k], v[k], tau[k])]
        for got, part in zip((a, by_q, by_v, M_inverse), (data.ddq, *wanted), strict=True):
            np.testing.assert_allclose(got[k], part, rtol=1e-10, atol=1e-11 * np.abs(part).max())


def test_a_joint_that_moves_no_inertia_has_no_finite_acceleration():
    model = _random_tree(2, 5)
    model.inertias[2], model.armature = pin.Inertia.Zero(), np.zeros(2)
    q, v, tau = np.ones((3, 2, 2))
    assert not np.isfinite(FreeEquations(model).acceleration(q, v, tau)[:, 1]).any()


@pytest.mark.parametrize(("n", "seed"), [(1, 1), (3, 2), (6, 3), (12, 4)])
def test_torques_of_a_body_are_what_pinocchios_model_asks_for_with_it_more_than_without(n, seed):
    model, rng = _random_tree(n, seed), np.random.default_rng(seed)
    equations, joints, bodies = FreeEquations(model), rng.integers(1, n + 1, 4), rng.normal(size=(4, 10))
    q, v, a = rng.normal(size=(3, 20, n)) * np.array([2.0, 3.0, 20.0])[:, None, None]
    before = equations.torque(q, v, a)
    for joint, body, found in zip(joints, bodies, equations.body_torques(list(joints), bodies, q, v, a), strict=True):
        heavier = model.copy()
        parameters = heavier.inertias[int(joint)].toDynamicParameters() + 1e-3 * body
        heavier.inertias[int(joint)] = pin.Inertia.FromDynamicParameters(parameters)
        expected = (FreeEquations(heavier).torque(q, v, a) - before) / 1e-3
        np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(before).max() + 1e-9 * np.abs(expected).max())
