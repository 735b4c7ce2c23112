# SPDX-License-Identifier: BSD-3-Clause
"""Effects of motors, drives, masses and locked joints in the torque balance: their columns are what they do."""

from __future__ import annotations

import numpy as np
import pytest
from shaken_arm import made_up

from jointscope.factors.calibration import Calibration
from jointscope.graphs.frequency.motor_effects import motor_effects
from jointscope.graphs.frequency.moving_arm import moving_arm
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage, next_stage, with_columns
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.added_effect import RIGID, at_null, with_effect
from jointscope.robots.geometry.arm_effects import KINDS, ArmHypothesis
from jointscope.robots.geometry.flexible_arm import LOSS

BY_ID = {kind.id: kind for kind in KINDS}
SMALL = {  # sizes at which the balance is still linear in them
    "gear_ripple@joint3": 1e-7,
    "spring_cubic@joint3": 1e6,
    "payload@robot": 1e-2,
    "link_mass@joint4": 1e-2,
    "inertia_error@joint2": 1e-2,
    "torque_constant_error@joint2": 1e-3,
    "torque_delay@robot": 1e-6,
    "motor_stribeck@joint1": 1e-2,
    "load_dependent_friction@joint2": 1e-4,
}


@pytest.fixture(scope="module")
def robot():
    return load_robot("tx90l")


@pytest.fixture(scope="module")
def pose():
    return ShakenPose.of(*made_up())


def effect(label):
    kind, _, owner = label.partition("@")
    return ArmHypothesis(BY_ID[kind], owner, 20 if kind == "gear_ripple" else None)


def settled(robot, pose, stages=2):
    problem = first_stage(robot, pose)
    for _ in range(stages):
        problem = next_stage(problem, problem.start(Calibration.of(robot))[1])
    return problem


def balance(problem):
    values = problem.stage.values
    return problem.torque_balance(values, problem.stiffness(values))


@pytest.mark.parametrize("label", SMALL)
def test_the_column_of_an_effect_is_what_the_whole_balance_does(label, robot, pose):
    hypothesis, base = effect(label), settled(robot, pose)
    column = with_columns(base, at_null(robot, [hypothesis])).stage.geometry[hypothesis.names[0]]
    size = SMALL[label]
    sizes = {name: size if i == 0 else 0.0 for i, name in enumerate(hypothesis.names)}
    moved = balance(settled(with_effect(robot, hypothesis, sizes), pose, 3)) - balance(settled(robot, pose, 3))
    # columns are those of the arm that stands; a wave makes its lines by the motion that carries the excitation
    share = 0.15 if hypothesis.kind.orders else 0.05
    assert np.linalg.norm(moved - size * column) < share * np.linalg.norm(moved)


def test_waves_per_turn_and_sharpness_have_the_columns_of_what_they_do(robot, pose):
    sizes = {"joint3.gear_ripple.cos": 1e-6, "joint3.gear_ripple.sin": 5e-7}
    ripple = with_effect(robot, effect("gear_ripple@joint3"), sizes)
    rough = with_effect(robot, effect("motor_stribeck@joint3"), {"joint3.motor_stribeck.torque": 3.0})
    for base, name, step in ((ripple, "joint3.gear_ripple.order", 1e-3), (rough, "joint3.friction_sharpness", 1.0)):
        problem, value = settled(base, pose, 3), base.parameters[name].value
        column = problem.balance(problem.stage.values)[2][name]
        moved = balance(settled(base.with_values({name: value + step}), pose, 3)) - balance(problem)
        assert np.linalg.norm(moved - step * column) < 0.15 * np.linalg.norm(moved)


def test_the_column_of_an_eccentric_encoder_is_what_it_does_beside_the_offset_that_poses_tell(robot, pose):
    hypothesis, size, base = effect("encoder_eccentricity@joint2"), 1e-2, settled(robot, pose)
    columns = with_columns(base, at_null(robot, [hypothesis])).stage.geometry
    for name, wave in zip(hypothesis.names, (np.cos, np.sin), strict=True):
        there = with_effect(robot, hypothesis, {n: size if n == name else 0.0 for n in hypothesis.names})
        there = there.with_values({"joint2.offset": size * float(wave(pose.q[1]))})
        moved = balance(settled(there, pose, 3)) - balance(settled(robot, pose, 3))
        assert np.linalg.norm(moved - size * columns[name]) < 0.1 * np.linalg.norm(moved)


def test_an_arm_that_is_found_about_its_stiffness_under_load_is_the_same_arm(robot, pose):
    hypothesis = effect("spring_cubic@joint2")
    hardening = with_effect(robot, hypothesis, {hypothesis.names[0]: 5e9})
    problem = settled(hardening, pose, 12)
    arm, values, x = problem.arm, problem.stage.values, problem.stage.x
    pose = problem.pose
    effects = motor_effects(arm, pose, values, problem.sharpness(values), x)
    more, offset = effects.stiffer, effects.offset
    assert more[1] > 1e-3 * values["joint2.stiffness"] and more[0] == more[2] == 0.0
    plain, about = (moving_arm(arm, pose, values, x, offset, each) for each in (None, more))
    np.testing.assert_allclose(about.torques, plain.torques, atol=1e-5 * np.abs(plain.torques).max())


def test_a_locked_joint_with_a_rigid_spring_is_a_locked_joint(robot, pose):
    stiff = at_null(robot, [effect("joint_elasticity@joint5"), effect("bearing_flexibility@joint4")])
    plain, sprung = (settled(each, pose, 1) for each in (robot, stiff))
    assert len(sprung.arm.springs) == len(plain.arm.springs) + 3
    np.testing.assert_allclose(balance(sprung), balance(plain), atol=1e-4 * np.abs(pose.torques).max())


def test_a_soft_locked_joint_changes_the_balance_by_its_compliance_at_first(robot, pose):
    hypothesis = effect("joint_elasticity@joint5")
    rigid = with_columns(settled(robot, pose), at_null(robot, [hypothesis]))
    values = dict(rigid.stage.values)
    k = 1e8  # its resonance is far above the lines
    change = rigid.stiffness({**values, "joint5.stiffness": k, "joint5.damping": 0.0}).Z - rigid.stiffness(values).Z
    spring = next(i for i, s in enumerate(rigid.arm.springs) if s.stiffness == "joint5.stiffness")
    kappa = RIGID * (1.0 + 1j * LOSS * pose.w[:, None, None])
    slope = -rigid.stiffness(values).by_spring[spring] * kappa**2
    np.testing.assert_allclose(change * k, slope, rtol=0.02, atol=0.02 * np.abs(slope).max())


def test_an_eccentric_encoder_of_a_motor_has_as_many_periods_per_turn_as_its_parameter_says(robot, pose):
    """A gear's ripple of the other sign is what moves the link alike; only the rotor moves with the encoder."""
    wave, ripple = effect("encoder_eccentricity@joint3"), effect("gear_ripple@joint3")
    sizes, name = (1e-3, -2e-3), "joint3.encoder_eccentricity.order"
    eccentric = with_effect(robot, wave, dict(zip(wave.names, sizes, strict=True)))
    problem = settled(eccentric, pose)
    values, x, sharpness = dict(problem.stage.values), problem.stage.x, problem.sharpness(problem.stage.values)

    def effects(**more):
        return motor_effects(problem.arm, problem.pose, {**values, **more}, sharpness, x)

    once, twenty = effects(), effects(**{name: 20.0})
    np.testing.assert_allclose(effects(**{name: 1.0}).offset, once.offset)
    plain = {n: v for n, v in values.items() if n not in wave.names}
    other = plain | {n: -v for n, v in zip(ripple.names, sizes, strict=True)} | {"joint3.gear_ripple.order": 20.0}
    geared = motor_effects(problem.arm, problem.pose, other, sharpness, x)
    np.testing.assert_allclose(twenty.offset, geared.offset, rtol=1e-9, atol=1e-15)
    assert np.abs(twenty.offset - once.offset).max() > 0.1 * np.abs(once.offset).max()
    step = 1e-4
    ends = [effects(**{name: 20.0 + sign * step}) for sign in (1.0, -1.0)]
    i, by_offset, by_torque = twenty.waves[name]
    for slope, part in ((by_offset, "offset"), (by_torque, "torque")):
        expected = (getattr(ends[0], part) - getattr(ends[1], part))[:, :, i] / (2.0 * step)
        np.testing.assert_allclose(slope, expected, atol=1e-5 * np.abs(expected).max())
