# SPDX-License-Identifier: BSD-3-Clause
"""Slopes of accelerations by parameters of the bodies, with any share of the Coriolis terms; geometry with errors."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from robots_to_compare import READY, _rigid, _with, _without_coriolis, mimicking, states, without_gyros

from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.geometry.calibrated_urdf import move_joints
from jointscope.robots.geometry.error_parameters import error_parameters
from jointscope.robots.model.structured_tree import StructuredTree
from jointscope.robots.urdf.urdf_tree import read_urdf, urdf_text

COUNT = 6
BLIND = without_gyros(mimicking(READY, READY.joints))
EFFECTS = ("inertia_error", "payload", "link_mass", "bearing_flexibility", "coriolis", "gravity_direction")
EFFECTS += ("axis_misalignment",)


def misplaced(robot):
    """With errors of its geometry, of millimetres and milliradians."""
    errors, rng = error_parameters(robot.joints, 1e-3, 3e-3), np.random.default_rng(4)
    values = {name: 3e-3 * rng.standard_normal() for name in errors}
    return replace(robot, parameters={**robot.parameters, **errors}).with_values(values)


def changed_bodies(robot):
    """Its bodies depend on parameters: inertias, a rotor on a link, a soft bearing, the share of the Coriolis terms."""
    robot = _rigid(_without_coriolis(robot), "joint2")
    for name in EFFECTS:
        if catalogue()[name].owners_of(robot):
            robot = _with(catalogue()[name], robot)
    return misplaced(robot)


@pytest.mark.parametrize("scale", [-0.2, 0.0, 0.37, 1.0, 1.3])
@pytest.mark.parametrize(
    "base", [READY, mimicking(READY, READY.joints), BLIND], ids=["doggy", "mimic joints", "no gyros"]
)
def test_slopes_by_parameters_of_the_bodies_are_those_of_differences(base, scale):
    robot = changed_bodies(base).with_values({"robot.coriolis.scale": scale})
    joints, x = ElasticJoints(robot), states(robot, COUNT)
    x[:, robot.layout.v_link] += 1.0
    u, values = np.zeros((COUNT, robot.n)), np.array([robot.parameters[name].value for name in joints.names])
    slopes = joints.with_derivatives(x, u, values).by_parameter
    of_bodies = (*EFFECTS, "inertia", *LENGTHS, *ANGLES)
    for k, name in enumerate(joints.names):
        if any(part in name.split(".") for part in of_bodies):
            step = 1e-5 * max(abs(values[k]), 0.3) * np.eye(len(values))[k]

            def difference(h, k=k):
                ahead, behind = (joints.accelerations(x, u, values + sign * h) for sign in (1, -1))
                return (ahead - behind) / (2.0 * h[k])

            # a step that rounding does not fill is long for a compliance: what it bends is taken off
            expected = (4.0 * difference(0.5 * step) - difference(step)) / 3.0
            size = max(np.abs(expected).max(), 1.0)
            np.testing.assert_allclose(slopes[:, :, k], expected, rtol=1e-5, atol=1e-6 * size, err_msg=name)


def test_errors_of_the_geometry_are_those_of_a_urdf_that_has_them(tmp_path):
    robot = misplaced(READY)
    root = read_urdf(robot.tree.urdf)
    nowhere = SimpleNamespace(link=None, tracker_link=None, targets=(), others=())  # no target
    move_joints(root, SimpleNamespace(poses=nowhere, values=robot.values, tree=robot.tree))
    (tmp_path / "moved.urdf").write_text(urdf_text(root), encoding="utf-8")
    gravity = np.array([0.0, 0.0, -9.81])
    moved = RigidTree(tmp_path / "moved.urdf", robot.joints, gravity)
    robot = replace(robot, tree=RigidTree(robot.tree.urdf, robot.joints, gravity))
    q, v, a = np.random.default_rng(5).standard_normal((3, COUNT, robot.n))
    bodies = StructuredTree(robot).bodies({name: p.value for name, p in robot.parameters.items()})
    np.testing.assert_allclose(bodies.torque(q, v, a), moved.torque(q, v, a), rtol=1e-9, atol=1e-9)
    assert np.abs(bodies.torque(q, v, a) - robot.tree.torque(q, v, a)).max() > 1e-3
