# SPDX-License-Identifier: BSD-3-Clause
"""The motion of many states with fixed parameters is that of the equations with derivatives, for every effect."""

from __future__ import annotations

import numpy as np
import pytest
from robots_to_compare import ROBOTS, states

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.rates_of_many import RatesOfMany
from jointscope.robots.files.effects_at_once import add_effects
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import ready_robots


def compare_with_elastic_joints(robot):
    joints, x = ElasticJoints(robot), states(robot, 9)
    u = np.random.default_rng(4).uniform(-1.0, 1.0, (9, robot.n))
    values = np.array([robot.parameters[name].value for name in joints.names])
    many, layout = RatesOfMany(robot), robot.layout
    expected = joints.accelerations(x, u, values)
    scale = 1e-11 * np.abs(expected).max()
    for some in (slice(None), slice(3, 4)):  # one state goes another way through pinocchio
        rate = many.rates(x[some], many.torque_of(u[some]))
        np.testing.assert_allclose(rate[:, layout.rates], expected[some], rtol=1e-10, atol=scale)
        np.testing.assert_array_equal(rate[:, layout.positions], x[some][:, layout.velocities])


@pytest.mark.parametrize("name", ROBOTS)
def test_rates_are_those_of_the_elastic_joints(name):
    compare_with_elastic_joints(ROBOTS[name])


def test_laws_of_rigid_joints_see_the_weight_that_they_carry(tmp_path):
    text = (
        ready_robots()["doggy"].read_text(encoding="utf-8").replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    )
    text = text.replace("gravity: [0.0, 0.0, 0.0] ", "gravity: [1.0, 3.0, -9.81] ")
    text = text.replace("integrator: simpson", "rigid_joints: [joint1, joint2]\n  integrator: simpson")
    (tmp_path / "heavy.yaml").write_text(text, encoding="utf-8")
    wanted = ["load_dependent_friction@*", "motor_viscous@*", "link_viscous@joint2", "asymmetric_friction@joint1"]
    robot = add_effects(load_robot(tmp_path / "heavy.yaml"), wanted).robot
    sizes = [name for name, p in robot.parameters.items() if p.effect and p.null == 0.0]
    heavy = robot.with_values(dict.fromkeys(sizes, 0.3))
    compare_with_elastic_joints(heavy)
    compare_with_elastic_joints(robot)
