# SPDX-License-Identifier: BSD-3-Clause
"""Arms that are shaken in the simulator: what shakes them, and what the estimator makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.robots.errors import EffectError, RobotError, SimulationError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.arm.multisine import CARRIER, Multisine
from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

POSES = (np.array([0.1, 0.72, 0.62, 1.2, 1.0, 0.3]), np.array([0.1, 0.5, 1.8, -0.9, 1.1, 0.3]))
SHORT = Shaking(poses=POSES[:1], realisations=1, f0=1.0, highest=60.0)


@pytest.fixture(scope="module")
def robot():
    return load_robot("tx90l")


def shaken(robot, seed=0, shaking=SHORT, **conditions):
    return simulate_frequency(robot, seed, PoseConditions(**conditions), shaking)


@pytest.fixture(scope="module")
def plain(robot):
    """One arm without effects."""
    return shaken(robot, 1)[0][0]


def test_experiments_of_a_realisation_are_orthogonal_and_signs_are_opposite():
    made = Multisine.drawn(0.5, 20.0, np.array([3.0, 2.0, 1.0]), 2, 0, "any")
    waves = np.array([made.torque(1, e, 1, 1e-3) for e in range(3)])
    np.testing.assert_allclose(waves.std(axis=1), np.tile([3.0, 2.0, 1.0], (3, 1)), rtol=1e-9)
    lines = np.fft.rfft(waves, axis=1)[:, made.lines]
    for k in range(len(made.lines)):
        U = lines[:, k] / np.abs(lines[0, k])
        np.testing.assert_allclose(U.conj().T @ U, 3.0 * np.eye(3), atol=1e-9)
    np.testing.assert_array_equal(made.torque(0, 1, -1, 1e-3), -made.torque(0, 1, 1, 1e-3))
    assert np.all(made.lines % 2 == 1) and CARRIER % 2 == 1


def test_the_same_seed_is_the_same_arm_in_both_kinds_and_rotors_are_as_the_file_says(robot):
    _, _, truth = shaken(robot, 4)
    _, at_poses = simulate_poses(robot, 3, 4)
    assert truth["parameters"] == at_poses["parameters"]
    assert truth["parameters"]["joint1.inertia"] == robot.parameters["joint1.inertia"].value


def test_a_rigid_motor_feels_what_its_arm_weighs(robot):
    """Far below all resonances torque over acceleration is the inertia of rotor and arm together."""
    stiff = {f"joint{j}.{part}": 1e6 for j in (1, 2, 3) for part in ("stiffness", "bearing.stiffness_x")}
    stiff |= {f"joint{j}.bearing.stiffness_y": 1e6 for j in (1, 2, 3)}
    stiff |= {f"joint{j}.{part}": 1e-9 for j in (1, 2, 3) for part in ("coulomb_torque", "motor_viscous.coefficient")}
    (made,), _, _ = shaken(robot, 0, values=stiff, perfect=True)
    out = made.signals.outputs
    motors = replace(made.signals, outputs=replace(out, values=out.values[:, :3], names=out.names[:3]))
    found = MeasuredResponse.of(motors, made.excitation).matrix
    model = robot.tree.model
    M = pin.crba(model, model.createData(), POSES[0])
    M = np.triu(M) + np.triu(M, 1).T
    rotors = [robot.parameters[f"joint{j}.inertia"].value for j in (1, 2, 3)]
    w = 2.0 * np.pi * found.frequencies
    seen = np.linalg.inv(found.G) / -(w[:, None, None] ** 2)
    middle = (found.frequencies > 1.5) & (found.frequencies < 5.5)
    expected = M[:3, :3] + np.diag(rotors)
    np.testing.assert_allclose(seen.real[middle].mean(axis=0), expected, atol=0.05 * np.max(expected))


def test_torques_that_are_late_turn_phases_and_say_nothing_else(robot, plain):
    (late,), _, truth = shaken(robot, 1, effects=["torque_delay@robot:seconds=0.001"])
    np.testing.assert_array_equal(plain.signals.outputs.values, late.signals.outputs.values)
    count = round(1.0 / plain.excitation.f0 * 1000.0)
    k = int(plain.excitation.lines[-1])
    first, second = (np.fft.rfft(r.signals.inputs.values[:count, 0])[k] for r in (plain, late))
    assert np.angle(second / first) == pytest.approx(-2.0 * np.pi * k * plain.excitation.f0 * 1e-3, abs=0.02)
    assert truth["effects"][0]["effect"] == "torque_delay"


def test_a_torque_constant_scales_the_torque_that_is_told(robot, plain):
    (other,), _, _ = shaken(robot, 1, effects=["torque_constant_error@joint2:share=0.25"])
    ratio = plain.signals.inputs.values.std(axis=0) / other.signals.inputs.values.std(axis=0)
    np.testing.assert_allclose(ratio, [1.0, 1.25, 1.0], rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "share"),
    [
        ("backlash@joint3:half_gap=1e-3", 0.01),
        ("spring_cubic@joint3:stiffness=1e12", 0.01),
        ("motor_stribeck@joint3:torque=6", 1e-3),  # at low speeds only: 50 times the encoder's noise
        ("load_dependent_friction@joint3:coefficient=0.1", 0.01),
    ],
)
def test_what_is_not_linear_changes_the_motion(effect, share, robot, plain):
    (odd,), _, _ = shaken(robot, 1, effects=[effect])
    q = [r.signals.outputs.values[:, 2] - r.signals.outputs.values[:, 2].mean() for r in (plain, odd)]
    assert np.std(q[1] - q[0]) > share * np.std(q[0])


@pytest.mark.parametrize(
    ("shaking", "text"),
    [
        (Shaking(poses=(np.zeros(3),)), "a pose of tx90l has 6 angles"),
        (Shaking(count=0), "expected 1 or more"),
        (Shaking(highest=480.0), "lines up to 480 Hz need samples at 1067 Hz"),
        (Shaking(rate=900.0), "expected 2000 Hz over a whole number"),
    ],
)
def test_what_cannot_be_shaken_is_refused(shaking, text, robot):
    with pytest.raises(SimulationError, match=text):
        simulate_frequency(robot, 0, shaking=shaking)


def test_robots_and_effects_that_cannot_be_shaken_are_named(robot):
    with pytest.raises(RobotError, match="has no section `frequency`"):
        simulate_frequency(load_robot("panda"))
    with pytest.raises(EffectError, match="cannot be simulated"):
        shaken(robot, effects=["cogging@joint1"])


def test_springs_that_the_engine_cannot_follow_are_refused(robot):
    with pytest.raises(SimulationError, match="the engine cannot follow"):
        shaken(robot, values={"joint1.stiffness": 1e9})


@pytest.mark.slow
def test_springs_of_an_arm_that_the_engine_shook_are_found_within_their_sigmas(robot):
    made, _, truth = shaken(robot, 7, Shaking(poses=POSES, realisations=1))
    result = calibrate_frequency(robot, [(r.signals, r.excitation) for r in made])
    names = [n for n in result.names if n[:6] in ("joint1", "joint2", "joint3") and ("stiff" in n or "damping" in n)]
    z = [(result.robot.parameters[n].value - truth["parameters"][n]) / result.robot.parameters[n].sigma for n in names]
    assert len(names) == 18 and np.max(np.abs(z)) < 4.0 and np.mean(np.square(z)) < 2.5
    for j in (1, 2, 3):
        name = f"joint{j}.stiffness"
        assert result.robot.parameters[name].value == pytest.approx(truth["parameters"][name], rel=0.01)
