# SPDX-License-Identifier: BSD-3-Clause
"""The torque balance and the logarithm of the matrix: derivatives and limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken_arm import LINES, RATE, N, made_up

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.motor_stiffness import motor_stiffness
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage, next_stage
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.flexible_arm import FlexibleArm


@pytest.fixture(scope="module")
def robot():
    """With rotors that are not known either."""
    found = load_robot("tx90l")
    rotors = {f"joint{j}.inertia": replace(found.parameters[f"joint{j}.inertia"], fixed=False) for j in (1, 2, 3)}
    return replace(found, parameters=found.parameters | rotors)


@pytest.fixture(scope="module")
def stages(robot):
    first = first_stage(robot, ShakenPose.of(*made_up()))
    return {"logarithm": first, "balance": next_stage(first, first.start(Calibration.of(robot))[1])}


@pytest.mark.parametrize("kind", ["logarithm", "balance"])
def test_derivatives_are_those_of_differences(kind, stages, robot):
    problem = stages[kind]
    at = problem.start(Calibration.of(robot))[1]
    # away from where the stage was found, where nothing cancels
    moved = at.with_points({DYNAMICS: at.dynamics + np.where(at.positive, 0.03, 2e-5)})
    _, J = problem.rows(moved)
    checked = 0
    for i, positive in enumerate(moved.positive):
        step = 1e-5 if positive else 1e-6
        pair = [moved.with_points({DYNAMICS: moved.dynamics + s * step * np.eye(len(at.names))[i]}) for s in (1, -1)]
        slope = (problem.rows(pair[0])[0] - problem.rows(pair[1])[0]) / (2.0 * step)
        size = np.abs(J[:, :, i]).max()
        np.testing.assert_allclose(J[:, :, i], slope, atol=2e-5 * size + 1e-6, err_msg=at.names[i])
        checked += size > 0.0
    assert checked >= (27 if kind == "logarithm" else 53)


def test_the_stiffness_of_one_motor_alone_is_a_spring_between_two_masses(robot):
    arm = FlexibleArm(robot)
    values = {name: p.value for name, p in robot.parameters.items()}
    stiff = values | {s.stiffness: 1e14 for s in arm.springs if s.stiffness != "joint3.stiffness"}
    stiff |= {s.damping: 0.0 for s in arm.springs}
    parts = arm.linearised(np.array([0.0, 0.3, 1.2, 0.0, 0.5, 0.0]), stiff).mean
    w, last = np.array([30.0, 80.0, 200.0]), arm.driven[2]
    k, M, G = values["joint3.stiffness"], parts[0][last, last], parts[2][last, last]
    load = G - w**2 * M
    expected = -(w**2) * values["joint3.inertia"] + k * load / (k + load)
    found = motor_stiffness(arm, parts, w, stiff).Z[:, 2, 2]
    np.testing.assert_allclose(found.real, expected, rtol=1e-5)
    np.testing.assert_allclose(found.imag, 0.0, atol=1e-4 * np.abs(expected).max())


def test_friction_turns_over_faster_than_samples_and_is_taken_between_them(robot):
    signals, excitation = made_up()
    pose = ShakenPose.of(signals, excitation)
    size, sharper = pose.friction(np.array([200.0, 200.0, 200.0]))
    step = 1e-4
    other = pose.friction(200.0 * np.exp(step) * np.ones(3))[0]
    np.testing.assert_allclose(sharper, (other - size) / step, atol=1e-3 * np.abs(sharper).max())


def test_without_pairs_lines_of_the_carrying_motion_are_left_out():
    signals, excitation = made_up()
    one = replace(excitation, experiments=tuple(e for e in excitation.experiments if e.sign == 1), carrier=3.0)
    assert RATE / N == 1.0
    pose = ShakenPose.of(signals, one)
    assert not np.any(pose.lines % 3 == 0) and len(pose.lines) < len(LINES)
