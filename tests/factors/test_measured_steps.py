# SPDX-License-Identifier: BSD-3-Clause
"""Steps over which a measured signal runs on, from their means and from their halves."""

from __future__ import annotations

import numpy as np

from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.step import Steps
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

ROBOT = load_robot("doggy")
W = 2.0 * np.pi * 6.0


def measured(robot, h=4e-3, m=100):
    """Steps of a sine of 6 Hz, and their edges."""
    edges = h * np.arange(m + 1.0)
    means = -np.diff(np.cos(W * edges)) / (W * h)
    u = np.column_stack([means, 2.0 * means, -means])
    path = CommandPath(edges, u, robot.effects, robot.joints, runs_on=True)
    return Steps(np.full(m, h), u, robot.noise, robot.layout, None, path, np.arange(m)), edges


def test_where_steps_begin_and_end_a_measured_signal_is_what_it_is_there():
    steps, edges = measured(ROBOT)
    factor = SimpsonDynamics(ElasticJoints(ROBOT), steps, ROBOT.joints)
    first, last = factor.commands_at_ends(np.array([ROBOT.parameters[n].value for n in factor.model.names]))
    inside = slice(1, -1)
    assert np.abs(first[inside, 0] - np.sin(W * edges[:-1][inside])).max() < 0.006  # constant over steps: 0.075
    assert np.abs(last[inside, 1] - 2.0 * np.sin(W * edges[1:][inside])).max() < 0.012


def test_halves_of_steps_go_on_from_each_other_and_make_the_whole():
    steps, _ = measured(ROBOT)
    values = {name: p.value for name, p in ROBOT.parameters.items()}
    first, second = steps.halves(values)
    rise = steps.rising(values)[0]
    np.testing.assert_allclose(0.5 * (first.u + second.u), steps.u, atol=1e-15)
    np.testing.assert_allclose(first.u + 0.5 * first.rise, second.u - 0.5 * second.rise, atol=1e-15)
    np.testing.assert_allclose(first.u - 0.5 * first.rise, steps.u - 0.5 * rise, atol=1e-15)
    np.testing.assert_array_equal(first.select(slice(3, 5)).rise, first.rise[3:5])


def test_a_measured_signal_that_is_late_by_a_part_of_a_step_keeps_its_size():
    robot = add_effect(ROBOT, "command_delay@robot", {"delay": -10e-3})
    steps, edges = measured(robot)
    values = {name: p.value for name, p in robot.parameters.items()}
    acting = steps.acting(values)[0]
    true = -np.diff(np.cos(W * (edges + 10e-3))) / (W * steps.h)
    inside = slice(5, -5)
    scale = float(acting[inside, 0] @ true[inside] / (true[inside] @ true[inside]))
    assert abs(scale - 1.0) < 5e-4  # of a staircase: 0.28 % too small
