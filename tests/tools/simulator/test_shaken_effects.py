# SPDX-License-Identifier: BSD-3-Clause
"""Effects in drives that are shaken: the simulator keeps their power balance, and the estimator sees what they do."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.frequency.rattling import dwellings
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage, next_stage
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.added_effect import with_effect
from jointscope.robots.geometry.arm_effects import KINDS, ArmHypothesis
from jointscope.tools.simulator.arm.arm_bodies import true_values
from jointscope.tools.simulator.arm.pose_effects import pose_effects
from jointscope.tools.simulator.arm.shaken_arm import ShakenArm
from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
from jointscope.tools.simulator.pose_simulation import PoseConditions

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
pytestmark = pytest.mark.slow

LOADED = np.array([0.1, 0.72, 0.62, 1.2, 1.0, 0.3])
LIGHT = np.array([-1.0, -0.69, 0.94, 1.36, 0.18, -1.53])  # the weight hardly loads drive 3
JOINTS = ("joint1", "joint2", "joint3")


@pytest.fixture(scope="module")
def robot():
    return load_robot("tx90l")


def shaken(robot, pose, *effects, **values):
    conditions = PoseConditions(effects=effects, values=values, perfect=True)
    made, _, truth = simulate_frequency(
        robot, 3, conditions, Shaking(poses=(pose,), realisations=1, f0=0.5, highest=60.0)
    )
    return ShakenPose.of(made[0].signals, made[0].excitation), truth["parameters"]


def test_what_a_wavy_gear_passes_on_is_the_slope_of_one_energy(robot):
    texts = ["gear_ripple@joint3:amplitude=2e-4,order=60,phase=0.3", "spring_cubic@joint2:stiffness=4e10"]
    values = true_values(robot, 0, {f"{joint}.damping": 0.0 for joint in JOINTS})
    arm = ShakenArm(robot, values, pose_effects(texts, robot.joints), LOADED, "smooth")
    k = np.array([values[f"{joint}.stiffness"] for joint in JOINTS])
    k3, size, order = np.array([0.0, 4e10, 0.0]), np.array([0.0, 0.0, 2e-4]), np.array([0.0, 0.0, 60.0])

    def energy(m, q):
        d = q - m - size * np.cos(order * m + 0.3)
        return float(np.sum(0.5 * k * d**2 + 0.25 * k3 * d**4))

    m, q, eye = np.array([0.1, 0.7, 0.6]), np.array([0.1002, 0.701, 0.5988]), 1e-7 * np.eye(3)
    pull, felt = arm._more_pull(q - m, np.zeros(3), m, np.zeros(3))
    on_links = [(energy(m, q - e) - energy(m, q + e)) / 2e-7 for e in eye]
    on_motors = [(energy(m - e, q) - energy(m + e, q)) / 2e-7 for e in eye]
    np.testing.assert_allclose(pull - k * (q - m), on_links, rtol=1e-6, atol=1e-4)
    np.testing.assert_allclose(k * (q - m) - felt, on_motors, rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize(
    ("label", "text", "size"),
    [
        ("motor_stribeck@joint2", "torque=6", 6.0),
        ("load_dependent_friction@joint2", "coefficient=0.05", 0.05),
        ("gear_ripple@joint3", "amplitude=1.6e-4,order=60,phase=0", 1.6e-4),
        ("spring_cubic@joint2", "stiffness=4e10", 4e10),
    ],
)
def test_an_effect_at_its_true_size_leaves_what_an_arm_without_it_leaves(label, text, size, robot):
    kind, _, owner = label.partition("@")
    hypothesis = ArmHypothesis(next(k for k in KINDS if k.id == kind), owner, 60)
    left = []
    for effects in ((), (f"{label}:{text}",)):
        pose, true = shaken(robot, LOADED, *effects)
        model = robot.with_values({name: value for name, value in true.items() if name in robot.parameters})
        if effects:
            sizes = {name: size if i == 0 else 0.0 for i, name in enumerate(hypothesis.names)}
            model = with_effect(model, hypothesis, sizes)
        problem = first_stage(model, pose)
        for _ in range(4):
            problem = next_stage(problem, problem.start(Calibration.of(model))[1])
        r = problem.torque_balance(problem.stage.values, problem.stiffness(problem.stage.values))
        left.append(np.sqrt(np.mean(np.abs(r) ** 2, axis=(0, 1))))
    assert np.all(left[1] < 1.3 * left[0])


@pytest.mark.parametrize(("gap", "named"), [(-2e-4, ["joint3"]), (0.0, [])])
def test_a_drive_that_rattles_in_its_gap_is_named_and_no_other_one_is(gap, named, robot):
    conditions = PoseConditions(values={"joint3.backlash": gap})
    made, _, _ = simulate_frequency(robot, 206, conditions, Shaking(poses=(LIGHT,), realisations=1))
    recorded = ShakenPose.of(made[0].signals, made[0].excitation)
    each = dwellings(recorded, JOINTS, {n: p.value for n, p in robot.parameters.items()}, np.full(3, 200.0))
    assert [one.joint for one in each if one.rattles] == named
    assert all(f"it rattles in a gap, backlash@{one.joint}" in str(one) for one in each)
