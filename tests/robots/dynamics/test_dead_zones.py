# SPDX-License-Identifier: BSD-3-Clause
"""Dead zones before a spring with a curve of its own: derivatives by both ends, and all ways to evaluate them agree."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.rates_of_many import RatesOfMany
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

CURVED = add_effect(load_robot("doggy"), "spring_curve@joint2", {"quadratic": 600.0, "cubic": 2e4})
LOOSE = {
    "backlash": add_effect(CURVED, "backlash@joint2", {"half_gap": 0.01}),
    "spring_slack": add_effect(CURVED, "spring_slack@joint2", {"forward": 0.02, "backward": 0.005}),
}


def states(robot):
    """Deflections of joint 2 on both sides of its dead zone and within it."""
    x = 0.1 * np.random.default_rng(2).normal(size=(5, robot.layout.size))
    x[:, robot.layout.joint_q[1]] = x[:, robot.layout.motor_q[1]] + [-0.03, -0.004, 0.006, 0.015, 0.04]
    return x


@pytest.mark.parametrize("name", LOOSE)
def test_derivatives_by_the_ends_of_a_dead_zone_reach_the_curve_behind_it(name):
    robot = LOOSE[name]
    joints, x, u = ElasticJoints(robot), states(robot), np.zeros((5, 3))
    p = np.array([robot.parameters[own].value for own in joints.names])
    found = joints.with_derivatives(x, u, p)
    own = [k for k, full in enumerate(joints.names) if full.startswith(("joint2.stiffness", f"joint2.{name}."))]
    assert len(own) == 1 + len(robot.effects[-1].effect.parameters)
    for k in own:
        step = 1e-6 * p[k] * np.eye(len(p))[k]
        slope = (joints.accelerations(x, u, p + step) - joints.accelerations(x, u, p - step)) / (2.0 * step[k])
        scale = np.abs(slope).max()
        assert scale > 0.0
        np.testing.assert_allclose(found.by_parameter[:, :, k], slope, rtol=1e-5, atol=1e-7 * scale)


@pytest.mark.parametrize("name", LOOSE)
def test_many_states_move_as_one_does(name):
    robot = LOOSE[name]
    joints, x, u = ElasticJoints(robot), states(robot), np.zeros((5, 3))
    p = np.array([robot.parameters[own].value for own in joints.names])
    rates = RatesOfMany(robot).rates(x, u)[:, [*robot.layout.joint_v, *robot.layout.motor_v]]
    np.testing.assert_allclose(joints.accelerations(x, u, p), rates, rtol=1e-9, atol=1e-9)
