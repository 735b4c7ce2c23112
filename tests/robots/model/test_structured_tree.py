# SPDX-License-Identifier: BSD-3-Clause
"""Slopes of accelerations by parameters of the bodies, with any share of the Coriolis terms."""

from __future__ import annotations

import numpy as np
import pytest
from robots_to_compare import READY, _rigid, _with, _without_coriolis, mimicking, states, without_gyros

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_catalogue import catalogue

COUNT = 6
BLIND = without_gyros(mimicking(READY, READY.joints))
EFFECTS = ("inertia_error", "payload", "link_mass", "bearing_flexibility", "coriolis", "gravity_direction")
EFFECTS += ("axis_misalignment",)


def changed_bodies(robot):
    """Its bodies depend on parameters: inertias, a rotor on a link, a soft bearing, the share of the Coriolis terms."""
    robot = _rigid(_without_coriolis(robot), "joint2")
    for name in EFFECTS:
        if catalogue()[name].owners_of(robot):
            robot = _with(catalogue()[name], robot)
    return robot


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
    of_bodies = (*EFFECTS, "inertia")
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
