# SPDX-License-Identifier: BSD-3-Clause
"""The engine simulates joints that follow others, and others that are locked, as the equations of motion have them."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.comparison.runge_kutta import runge_kutta
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.dynamics.state_rates import StateRates
from jointscope.robots.files.robot_file import load_robot

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

URDF = """<robot name="arm"><link name="base"/>
<joint name="a" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
<link name="a"><inertial><origin xyz="0.1 0 0.2"/><mass value="3"/>
 <inertia ixx="0.05" iyy="0.05" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="b" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.4" rpy="0.5 0.1 0"/>
 <axis xyz="0.6 0 -0.8"/><mimic joint="a" multiplier="-0.8" offset="0.2"/>
 <limit effort="40" velocity="10" lower="-9" upper="9"/></joint>
<link name="b"><inertial><origin xyz="0.05 0 0.15"/><mass value="2"/>
 <inertia ixx="0.03" iyy="0.01" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="c" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0 0.1 0.3"/><axis xyz="1 0 0"/>
 <limit effort="40" velocity="10" lower="-3" upper="3"/></joint>
<link name="c"><inertial><origin xyz="0 0.2 0.1"/><mass value="1"/>
 <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(URDF)
    pendulum = load_robot("doggy")
    tree = RigidTree(path, ("a",), np.array([0.5, 0.0, -9.81]), locked={"c": 0.8})
    names = {name: p for name, p in pendulum.parameters.items() if name.startswith("joint1")}
    own = {name.replace("joint1", "a"): replace(p, name=name.replace("joint1", "a")) for name, p in names.items()}
    shared = {name: p for name, p in pendulum.parameters.items() if name.startswith("motor")}
    encoder = replace(pendulum.motor_encoder, joints=("a",))
    return replace(
        pendulum, tree=tree, joints=("a",), parameters={**shared, **own}, sensors={encoder.name: encoder}
    ).with_values({"a.coulomb_torque": 0.1, "motor.inertia": 0.3})


def test_a_fall_with_a_follower_and_a_locked_joint_is_that_of_the_equations(robot):
    from jointscope.tools.simulator.world.engine import STEPS_PER_TICK, TICK, Engine

    engine, ticks = Engine(robot, friction="smooth"), 800
    engine.place(np.array([0.6]))
    nothing = np.zeros((ticks, 1))
    fallen = engine.run(lambda k, past: np.zeros(1), nothing, nothing, lambda done: None)
    rates, torque = StateRates(robot), np.zeros(1)
    x = robot.layout.from_joints(np.array([[0.6, 0.0, 0.6, 0.0]]))[0]
    for _ in range(ticks * STEPS_PER_TICK):
        x = runge_kutta(lambda at: rates.rates(at, torque), x, TICK / STEPS_PER_TICK)
    assert abs(fallen.q[-1, engine.link[0]] - 0.6) > 0.9
    np.testing.assert_allclose(fallen.q[-1, engine.link], x[robot.layout.q_link], atol=2e-6)
    np.testing.assert_allclose(fallen.v[-1, engine.link], x[robot.layout.v_link], atol=2e-5)
    b = engine.coordinates.index("b")
    np.testing.assert_allclose(fallen.q[:, b], 0.2 - 0.8 * fallen.q[:, engine.link[0]], atol=1e-7)
