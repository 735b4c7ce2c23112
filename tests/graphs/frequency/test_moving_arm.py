# SPDX-License-Identifier: BSD-3-Clause
"""What the motors of an arm need for a motion as large as it is, against small motion, rigid arms and an engine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from shaken_arm import LINES, POSE, made_up

from jointscope.graphs.frequency.motor_stiffness import motor_stiffness
from jointscope.graphs.frequency.moving_arm import moving_arm
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.flexible_arm import FlexibleArm
from jointscope.tools.simulator import frequency_simulation
from jointscope.tools.simulator.pose_simulation import PoseConditions


@pytest.fixture(scope="module")
def robot():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def values(robot):
    return {name: p.value for name, p in robot.parameters.items()}


def of_size(pose, size):
    """The pose under its motion times a number."""
    Y, common = size * pose.found.Y, size * pose.found.common
    common[:, :, 0] = pose.found.common[:, :, 0]
    return replace(pose, found=replace(pose.found, Y=Y, common=common), carrier=size * pose.carrier)


def standing(arm, pose, values):
    Z = motor_stiffness(arm, arm.linearised(pose.q, values).mean, pose.w, values).Z
    return np.einsum("lij,elj->eli", Z, pose.motion[:, pose.lines])


def test_under_small_motion_it_is_the_arm_that_stands(robot, values):
    arm, pose = FlexibleArm(robot), of_size(ShakenPose.of(*made_up()), 1e-4)
    small = moving_arm(arm, pose, values).torques[:, pose.lines]
    expected = standing(arm, pose, values)
    np.testing.assert_allclose(small, expected, atol=1e-4 * np.abs(expected).max())


def test_what_the_motion_adds_grows_with_it(robot, values):
    """Inertias follow the position: what they add is of second order in the motion and more."""
    arm, pose = FlexibleArm(robot), ShakenPose.of(*made_up())
    added = []
    for size in (0.25, 0.5, 1.0):
        scaled = of_size(pose, size)
        moving = moving_arm(arm, scaled, values).torques[:, pose.lines]
        added.append(np.linalg.norm(moving - standing(arm, scaled, values)))
    assert added[1] > 3.0 * added[0] and added[2] > 3.0 * added[1]


@pytest.mark.parametrize("pairs", [True, False])
def test_a_rigid_arm_needs_what_its_bodies_need_at_every_moment(robot, values, pairs):
    signals, excitation = made_up()
    if not pairs:
        single = tuple(e for e in excitation.experiments if e.sign == -1)
        excitation = replace(excitation, experiments=single)
    pose = ShakenPose.of(signals, excitation)
    arm = FlexibleArm(robot)
    stiff = values | {s.stiffness: 1e12 for s in arm.springs} | {s.damping: 0.0 for s in arm.springs}
    found = moving_arm(arm, pose, stiff).torques
    f0, K = excitation.f0, pose.motion.shape[1]
    model = robot.tree.model
    data, n = model.createData(), 1024
    t, w = np.arange(n) / n / f0, 2.0 * np.pi * f0 * np.arange(K)
    rotors = [values[f"joint{i}.inertia"] for i in (1, 2, 3)]
    needed = []
    for sign in (1, -1) if pairs else (-1,):
        m = sign * pose.motion[0] + (pose.found.common[0, :, :K].mean(axis=0) if pairs else 0.0)
        waves = np.exp(1j * np.outer(t, w))
        waves[:, 1:] *= 2.0
        q, v, a = ((waves @ (factor[:, None] * m)).real for factor in (np.ones(K), 1j * w, -(w**2)))
        tau = np.zeros((n, 3))
        for k in range(n):
            whole, rates, rise = np.r_[q[k], POSE[3:]], np.r_[v[k], 0, 0, 0], np.r_[a[k], 0, 0, 0]
            tau[k] = pin.rnea(model, data, whole, rates, rise)[:3] + rotors * a[k]
        needed.append(sign * np.fft.fft(tau, axis=0)[:K] / n)
    expected = np.mean(needed, axis=0)
    np.testing.assert_allclose(found[0, LINES], expected[LINES], atol=1e-5 * np.abs(expected[LINES]).max())


def test_an_engine_that_integrates_the_arm_agrees_ten_times_better_than_small_motion(robot, monkeypatch):
    pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
    monkeypatch.setattr(frequency_simulation, "ENCODER", 0.0)
    monkeypatch.setattr(frequency_simulation, "TORQUE", 0.0)
    smooth = {f"joint{j}.coulomb_torque": 1e-9 for j in (1, 2, 3)}
    shaking = frequency_simulation.Shaking(poses=(POSE,), realisations=1, f0=1.0, highest=40.0)
    (made,), _, truth = frequency_simulation.simulate_frequency(robot, 3, PoseConditions(values=smooth), shaking)
    pose = ShakenPose.of(made.signals, made.excitation)
    true = {name: p.value for name, p in robot.parameters.items()} | truth["parameters"]
    arm = FlexibleArm(robot)
    viscous = 1j * pose.w[:, None] * [true[f"joint{j}.motor_viscous.coefficient"] for j in (1, 2, 3)]
    rest = pose.torques - viscous * pose.motion[:, pose.lines]
    left = np.linalg.norm(rest - moving_arm(arm, pose, true).torques[:, pose.lines])
    small = np.linalg.norm(rest - standing(arm, pose, true))
    assert left < 0.1 * small
