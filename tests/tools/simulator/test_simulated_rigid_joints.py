# SPDX-License-Identifier: BSD-3-Clause
"""Joints that a robot file declares rigid are simulated rigid: the rotor turns with its link."""

import numpy as np
import pinocchio as pin
import pytest
from tilted_arm import CONSTANT, FRICTION, ROTORS, arm_with

from jointscope.robots.errors import EffectError
from jointscope.tools.simulator import simulate
from jointscope.tools.simulator.effects import make_effect, simulated_effects
from jointscope.tools.simulator.world.effect import owners_of
from jointscope.tools.simulator.world.engine import Engine

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

VISCOUS = 0.7


@pytest.mark.parametrize("unit", ["N m", "A"])
def test_rotor_and_friction_of_a_rigid_joint_are_those_of_its_link(tmp_path, unit):
    engine = Engine(
        arm := arm_with(tmp_path, unit=unit), [make_effect(f"motor_viscous@elbow:coefficient={VISCOUS}", arm)]
    )
    model = pin.buildModelFromUrdf(str(tmp_path / "arm.urdf"))
    model.armature = np.array(list(ROTORS.values()))
    rng, k = np.random.default_rng(0), CONSTANT if unit == "A" else 1.0
    for _ in range(5):
        q, v, command = rng.uniform(-1.5, 1.5, (3, 2))
        v += np.sign(v)  # sliding, far from where the engine lets friction creep
        command *= 20.0
        torque = k * command - FRICTION * np.sign(v) - [0.0, VISCOUS * v[1]]
        # pinocchio's forward dynamics know the armature
        expected = pin.aba(model, model.createData(), q, v, torque)
        assert engine.accelerations(q, v, command) == pytest.approx(expected, rel=2e-3, abs=2e-3)


@pytest.mark.parametrize("unit", ["N m", "A"])
def test_a_rigid_arm_moves_within_its_limits_and_holds_itself(tmp_path, unit):
    simulation = simulate(arm_with(tmp_path, unit=unit), "calibration", 12.0, 3)
    q, v = simulation.states[:, :2], simulation.states[:, 2:4]
    assert np.abs(v).max() < 4.0
    assert np.all(np.abs(q) < [3.0, 2.0])
    assert np.all(np.ptp(q, axis=0) > 1.0)
    assert np.all(v.std(axis=0) > 0.3)
    assert np.array_equal(simulation.states[:, :4], simulation.states[:, 4:])  # rotors


def test_beside_a_rigid_joint_another_may_be_elastic(tmp_path):
    robot = arm_with(tmp_path, rigid=("shoulder",))
    simulation = simulate(robot, "moves", 3.0, 1)
    deflection = simulation.states[:, [0, 1]] - simulation.states[:, [4, 5]]
    assert np.all(deflection[:, 0] == 0.0)
    assert 1e-3 < np.abs(deflection[:, 1]).max() < 0.2


@pytest.mark.parametrize("effect_id", list(simulated_effects()))
def test_every_effect_runs_on_a_rigid_arm_or_says_that_it_needs_a_spring(tmp_path, effect_id):
    robot = arm_with(tmp_path)
    kinds = simulated_effects()[effect_id].acts_on
    owners = [owner for kind in kinds for owner in owners_of(kind, robot)]
    if not owners:
        assert kinds in (("elastic joint",), ("weighed elastic joint",), ("imu",), ("joint seen on the link",))
        with pytest.raises(EffectError, match=f"{effect_id} cannot act on 'elbow'; it needs an? {kinds[0]}, and"):
            make_effect(f"{effect_id}@elbow", robot)
        return
    simulation = simulate(robot, "moves", 1.0, 1, effects=[f"{effect_id}@{owners[-1]}"])
    assert np.isfinite(simulation.states).all()
    assert np.abs(simulation.states).max() < 50


def test_gravity_loads_the_gear_of_a_rigid_joint(tmp_path):
    robot = arm_with(tmp_path)
    effect = make_effect("load_dependent_friction@shoulder:coefficient=0.25", robot)
    engine = Engine(robot, [effect])
    model = pin.buildModelFromUrdf(str(tmp_path / "arm.urdf"))
    data = model.createData()
    q, v = np.array([0.9, -0.4]), np.array([1.5, 1.0])
    for _ in range(2):  # the engine has the load of the evaluation before
        found = engine.accelerations(q, v, np.zeros(2))
    load = pin.nonLinearEffects(model, data, q, v)
    model.armature = np.array(list(ROTORS.values()))
    torque = -np.array([FRICTION + 0.25 * abs(load[0]), FRICTION])
    expected = pin.aba(model, model.createData(), q, v, torque)
    assert found[0] == pytest.approx(expected[0], rel=0.02)
