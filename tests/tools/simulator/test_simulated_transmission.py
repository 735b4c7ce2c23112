# SPDX-License-Identifier: BSD-3-Clause
"""Coupled joints in the engine, whose fixed tendons know no matrix of torques, against the equations of motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.simulator import simulate
from jointscope.tools.simulator.effects import make_effect
from jointscope.tools.simulator.world.engine import Engine

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

DOGGY = load_robot("doggy")
T = np.array([[1.1, 0.0, 0.0], [0.3, 0.9, 0.0], [-0.1, 0.25, 1.0]])
EFFECTS = {
    "load_dependent_friction@joint2": {"coefficient": 0.25},
    "spring_curve@joint3": {"quadratic": 600.0, "cubic": 2e4},
    "link_viscous@joint1": {"coefficient": 1.0},
    "kinematic_coupling@joint3": {"from_joint1": 0.05, "from_joint2": 0.0},
    "kinematic_coupling@joint1": {"from_joint2": -0.04, "from_joint3": 0.0},
}


def test_accelerations_are_those_of_the_engine_with_effects_on_every_side():
    robot, rng = replace(DOGGY, transmission=T), np.random.default_rng(1)
    simulated = [
        make_effect(label + ":" + ",".join(f"{name}={value}" for name, value in sizes.items()), robot)
        for label, sizes in EFFECTS.items()
    ]
    engine, modelled = Engine(robot, simulated, "smooth"), robot
    for label, sizes in EFFECTS.items():
        modelled = add_effect(modelled, label, sizes)
    joints = ElasticJoints(modelled)
    values = np.array([modelled.parameters[name].value for name in joints.names])
    for _ in range(4):
        q, v, u = rng.uniform(-0.8, 0.8, (3, 3))
        q_motor = np.linalg.solve(T, q) + 0.03 * rng.normal(size=3)
        v_motor = np.linalg.solve(T, v) + 0.03 * rng.normal(size=3)
        x = np.zeros((2, 6))
        x[:, engine.link], x[:, engine.motor] = (q, v), (q_motor, v_motor)
        a = engine.accelerations(*x, u)
        state = modelled.layout.from_joints(np.hstack([q, v, q_motor, v_motor])[None])
        found = joints.accelerations(state, u[None], values)[0]
        np.testing.assert_allclose(a[engine.link], found[:3], rtol=1e-7, atol=1e-6)
        np.testing.assert_allclose(a[engine.motor][[0, 2]], found[[3, 5]], rtol=1e-7, atol=1e-6)
        # the law of the load-dependent friction rounds the tip of |load| off
        np.testing.assert_allclose(a[engine.motor][1], found[4], atol=0.01)


@pytest.mark.slow
def test_elements_of_the_matrix_are_calibrated_from_a_simulated_recording():
    truth = replace(DOGGY, transmission=np.array([[1.0, 0, 0], [0, 1, 0], [0, -0.19, 0.8]]))
    run = simulate(truth, "calibration", 2.0, seed=4, friction="smooth")
    start = {"joint3.from_joint2": -0.15, "joint3.from_joint3": 0.83}
    elements = {name: Parameter(name, value, "rad/rad", value, 1.0, False) for name, value in start.items()}
    guess = np.array([[1.0, 0, 0], [0, 1, 0], [0, -0.15, 0.83]])
    robot = replace(DOGGY, transmission=guess, parameters={**elements, **DOGGY.parameters})
    found = calibrate(robot, [run.recording]).robot.parameters
    for name, expected in {"joint3.from_joint2": -0.19, "joint3.from_joint3": 0.8}.items():
        assert abs(found[name].value - expected) < 3.0 * found[name].sigma < 2e-3
