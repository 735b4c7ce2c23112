# SPDX-License-Identifier: BSD-3-Clause
"""Robots that `simulate --kind rests` brings to rest, against the balance of torques that a page works out."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.bodies.known_loads import known_loads
from jointscope.robots.errors import SimulationError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.rests.rests import find_rests
from jointscope.tools.simulator.loop.postures import Holding, drawn_postures
from jointscope.tools.simulator.loop.sensing import Sampling
from jointscope.tools.simulator.occasion import Conditions
from jointscope.tools.simulator.rest_simulation import Resting, simulate_rests
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.sticking_engine import StickingEngine

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

FRICTION = tuple(f"weight_dependent_friction@joint{i}:coefficient=0.08,quadratic=0.02" for i in (1, 2, 3, 4))
SLOW = Sampling(encoder_rate=200.0, gyro_rate=200.0)


@pytest.fixture(scope="module")
def bench():
    conditions = Conditions(parameters={"joint3.stiffness": 1.4}, effects=FRICTION, sampling=SLOW)
    return load_robot("biorob"), simulate_rests(
        load_robot("biorob"), 3, conditions, Resting(3, (0.0, 0.15), hold=1.0), "a"
    )


def balance(robot, truth, rest):
    """Torque of each spring, and what weight and load ask of it, by a textbook and another library [N m]."""
    true, q, motors = truth["parameters"], np.array(rest["links"]), np.array(rest["motors"])
    K = np.array([true[f"{joint}.stiffness"] for joint in robot.joints])
    T, model = robot.transmission, robot.tree.model
    data = model.createData()
    weight = pin.computeGeneralizedGravity(model, data, q)
    J = pin.computeFrameJacobian(model, data, q, model.getFrameId(truth["at"]), pin.LOCAL_WORLD_ALIGNED)[:3]
    hung = J.T @ np.array([0.0, 0.0, -9.81 * rest["mass"]])
    return K * (motors - np.linalg.solve(T, q)), T.T @ (weight - hung)


def test_springs_carry_the_weight_of_the_arm_and_what_hangs_on_it_while_it_hangs_there(bench):
    robot, found = bench
    for rest in found.truth["rests"]:
        springs, asked = balance(robot, found.truth, rest)
        np.testing.assert_allclose(springs, asked, atol=0.01)  # [N m] links may still swing by an encoder's step
    assert [rest["mass"] for rest in found.truth["rests"]] == [0.0, 0.15, 0.15, 0.0, 0.0, 0.15]


def test_friction_holds_each_motor_within_the_band_that_its_load_gives(bench):
    robot, found = bench
    stream, command = (found.recording.streams[name] for name in ("motor_encoder", "command"))
    for rest in found.truth["rests"]:
        springs, asked = balance(robot, found.truth, rest)
        held, most = np.array(rest["friction"]), np.array(rest["most_friction"])
        np.testing.assert_allclose(most, 0.05 + 0.08 * np.abs(asked) + 0.02 * asked**2, atol=2e-3)
        assert np.all(np.abs(held) <= most * (1.0 + 1e-9))
        rows = (command.times >= rest["begin"]) & (command.times < rest["end"])
        gains = [robot.parameter(f"{joint}.k_pwm").value for joint in robot.joints]
        balanced = gains * command.values[rows].mean(axis=0) + held - springs
        np.testing.assert_allclose(balanced, 0.0, atol=0.01)
        seen = stream.values[(stream.times >= rest["begin"]) & (stream.times < rest["end"])]
        assert np.all(np.ptp(seen, axis=0) <= 6.0 * robot.motor_encoder.sigmas)


def test_the_reader_finds_every_rest_with_its_load_and_every_motor_comes_from_elsewhere(bench):
    robot, found = bench
    rests = find_rests(found.recording, robot, found.loads)
    for k, rest in enumerate(found.truth["rests"]):
        middle = 0.5 * (rest["begin"] + rest["end"])
        (i,) = np.flatnonzero((rests.times[:, 0] <= middle) & (middle <= rests.times[:, 1]))
        np.testing.assert_allclose(rests.forces[i], [0.0, 0.0, -9.81 * rest["mass"]], atol=1e-12)
        np.testing.assert_allclose(rests.q_link[i], rest["links"], atol=1e-3)
        assert k % 2 or rests.moved[i].all()  # the first of each posture


def test_loads_change_step_by_step_and_only_while_the_motors_were_brought_to_rest(bench):
    _, found = bench
    changes, rests = found.loads.changes, found.truth["rests"]
    assert all(rest["end"] <= changes[0] or rest["begin"] >= changes[0] for rest in rests)
    for change in changes:
        assert not any(rest["begin"] < change < rest["end"] for rest in rests)
    steps = np.abs(np.diff(found.loads.forces[:, 2]))
    assert steps.max() < 0.1 * 9.81 * 0.15  # a hand does not let go


def test_the_same_seed_is_the_same_recording_and_another_session_has_other_postures(bench):
    robot, found = bench
    how = {"parameters": {"joint3.stiffness": 1.4}, "effects": FRICTION, "sampling": SLOW}
    once, again, other = (
        simulate_rests(robot, 3, Conditions(**how), Resting(1, (0.0,), hold=0.6), session)
        for session in ("a", "a", "b")
    )
    np.testing.assert_array_equal(once.recording.command.values, again.recording.command.values)
    assert once.truth == again.truth and once.loads is None
    assert not np.allclose(once.truth["rests"][0]["motors"], other.truth["rests"][0]["motors"], atol=0.05)
    assert once.truth["parameters"] == other.truth["parameters"] == found.truth["parameters"]


def test_a_motor_that_friction_holds_does_not_creep_at_all():
    robot = true_robot(load_robot("biorob"), {})
    engine = StickingEngine(robot, (), "attachment")
    engine.place(np.array([0.0, -1.535, 0.03, 0.02]))  # hangs nearly, and swings by less than friction holds

    class Nobody:
        force, finished = np.zeros(3), False

        def __call__(self, tick, past):
            return np.zeros(4)

    still = np.zeros((4000, 4))
    past = engine.experiment(Nobody(), still, still, lambda done: None)
    held, most = engine.friction()
    assert engine.sticks().all() and np.all(np.abs(held) < most)
    assert np.any(np.abs(held) > 0.2 * most)  # under load
    assert np.all(np.ptp(past.q[-1000:, engine.motor], axis=0) == 0.0)
    engine.model.dof_frictionloss[:] *= 1e-3  # friction gives way, and it moves again
    later = engine.experiment(Nobody(), still[:1000], still[:1000], lambda done: None)
    assert np.all(np.ptp(later.q[:, engine.motor], axis=0) > 1e-3)


def test_drawn_postures_are_held_by_drives_within_limits_and_come_from_both_sides():
    robot = true_robot(load_robot("biorob"), {})
    holding, force = Holding(robot), np.array([0.0, 0.0, -3.0])
    postures = drawn_postures(holding, 40, [force], "attachment", np.random.default_rng(2))
    low, high = robot.tree.limits.T
    for posture in postures:
        assert np.all((low < posture.q) & (posture.q < high) & (low < posture.before) & (posture.before < high))
        still = np.zeros((1, 4))
        weight = robot.tree.torque(posture.q[None], still, still)[0]
        load = known_loads(robot.tree, ["attachment"], force[None], posture.q[None]).torque[0]
        assert np.all(np.abs(holding.T.T @ (weight - load)) < holding.most)
    sides = np.array([np.sign(posture.q - posture.before) for posture in postures])
    assert np.all(np.abs(sides.mean(axis=0)) < 0.5)
    with pytest.raises(SimulationError, match="give lighter --weights, another --at"):
        drawn_postures(holding, 3, [300.0 * force], "attachment", np.random.default_rng(2))


@pytest.mark.parametrize(
    ("resting", "text"),
    [
        (Resting(0), "number of postures: expected 1 or more, got 0"),
        (Resting(1, (-0.5,)), "weights: expected masses of 0 kg or more, got -0.5"),
        (Resting(1, (1.0, 1.0)), "weights: expected each once, got 1, 1"),
        (Resting(1, hold=0.2), "hold: expected 0.6 to 60 s, got 0.2"),
        (Resting(1, at="hook"), "--at hook: no such link in biorob.urdf"),
        (Resting(1, (0.1,), at="base"), "link 'base' of biorob does not move, so no weight can act on it"),
    ],
)
def test_what_cannot_be_is_refused(resting, text):
    with pytest.raises(SimulationError, match=text):
        simulate_rests(load_robot("biorob"), 0, Conditions(sampling=SLOW), resting)


def test_weights_that_weigh_nothing_and_motors_that_slide_are_refused():
    with pytest.raises(SimulationError, match="doggy has no gravity, so weights pull at nothing"):
        simulate_rests(load_robot("doggy"), 0, Conditions(), Resting(1, (1.0,)))
    with pytest.raises(SimulationError, match="motors would slide for ever"):
        simulate_rests(load_robot("biorob"), 0, Conditions(friction="smooth"), Resting(1))
