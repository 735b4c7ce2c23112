# SPDX-License-Identifier: BSD-3-Clause
"""The controllers of the BioRob: the automaton edge by edge, laws at rest, the order of the paper's table 8."""

import numpy as np
import pytest

from jointscope.robots.dynamics.transmission import motor_angles
from jointscope.robots.errors import SimulationError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.closed_loop.controllers.flexible_joint_control import RECIPES, FlexibleJointControl
from jointscope.tools.closed_loop.controllers.friction_automaton import (
    BACKWARDS,
    FORWARDS,
    NEAR,
    REST,
    FrictionAutomaton,
)
from jointscope.tools.closed_loop.planning.moves_plan import moves_plan
from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop
from jointscope.tools.report import closed_loop_report
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.engine import TICK, Engine

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")


def automaton():
    return FrictionAutomaton(np.array([0.05]), np.array([0.001]), np.array([0.1]))


def step(machine, error, velocity):
    torque = machine.torque(np.array([error]), np.array([velocity]), np.array([2.0]))
    return int(machine.states[0]), float(torque[0])


def test_a_resting_motor_is_pushed_towards_its_goal():
    assert step(automaton(), 0.0005, 0.0) == (REST, 1.0)
    assert step(automaton(), -0.1, 0.02) == (REST, -2.0)


def test_a_motor_that_is_where_it_should_be_is_helped_along_its_velocity():
    assert step(automaton(), 0.0005, -0.06) == (NEAR, pytest.approx(-1.2))


def test_the_direction_turns_only_beyond_the_velocity_that_is_sure():
    machine = automaton()
    assert step(machine, 0.1, 0.2) == (FORWARDS, 2.0)
    assert step(machine, 0.1, -0.075) == (FORWARDS, pytest.approx(-1.0))
    assert step(machine, 0.1, -0.11) == (BACKWARDS, -2.0)
    assert step(machine, 0.1, 0.075) == (BACKWARDS, pytest.approx(1.0))
    assert step(machine, 0.1, 0.11) == (FORWARDS, 2.0)
    assert step(machine, 0.1, 0.0)[0] == REST


@pytest.fixture(scope="module")
def arm():
    return true_robot(load_robot("biorob"), {})


def test_on_the_plan_at_rest_a_controller_asks_for_the_weight_alone(arm):
    home = np.array([0.3, -0.4, 0.5, -0.2])
    times = np.arange(4100) * TICK
    plan = moves_plan(arm, times, home, np.random.default_rng(0))
    law = FlexibleJointControl(arm, plan, RECIPES["pd_both"])
    x = np.zeros(arm.layout.size)
    x[arm.layout.joint_q] = home
    engine = Engine(arm, friction="smooth")
    q = np.zeros(engine.model.nq)
    x[arm.layout.motor_q] = law._reference[0, arm.layout.motor_q]
    q[engine.link], q[engine.motor] = x[arm.layout.joint_q], x[arm.layout.motor_q]
    at_rest = engine.accelerations(q, 0.0 * q, law.command(0, x))
    np.testing.assert_allclose(at_rest, 0.0, atol=1e-4)
    assert np.abs(motor_angles(arm, home) - x[arm.layout.motor_q]).max() > 1e-3


def test_moves_of_the_biorob_span_more_than_half_a_turn(arm):
    plan = moves_plan(arm, np.arange(10000) * TICK, np.zeros(4), np.random.default_rng(1))
    assert np.all(np.ptp(plan.q, axis=0) > np.pi)
    np.testing.assert_allclose(np.gradient(plan.q, TICK, axis=0)[1:-1], plan.v[1:-1], atol=1e-3)


def test_dry_friction_holds_a_light_rotor_under_a_quarter_of_it(arm):
    engine = Engine(arm.with_values({"joint1.coulomb_torque": 0.2}))
    engine.place(np.array([0.0, -np.pi / 2, 0.0, 0.0]))
    rows, pushed = np.zeros((2000, 4)), np.array([0.05, 0.0, 0.0, 0.0])  # [V], nearly as many N m
    motor = engine.run(lambda tick, past: pushed, rows, rows, lambda done: None).q[:, engine.motor[0]]
    assert abs(motor[-1] - motor[0]) < 2.0 * np.pi / 2048 / 23  # [rad] a step of its encoder at the pulley


def test_gains_of_another_robot_are_not_guessed():
    with pytest.raises(SimulationError, match=r"known for biorob; use --controllers p,state_feedback"):
        run_closed_loop(load_robot("doggy"), None, 3.5, options=LoopOptions(controllers=("pd_both",)))


@pytest.mark.slow
def test_the_controllers_stand_in_the_order_of_the_paper():
    said = []
    result = run_closed_loop(
        load_robot("biorob"),
        seconds=4.1,
        options=LoopOptions(sources=("true",)),
        say=said.append,
    )
    page = closed_loop_report(result)
    assert "Best: inverse dynamics, friction, true state" in page and "follows a plan" in page
    assert "unstable at home" in page and "PD in motor, gravity, friction" in page
    e = {run.controller: run.tracking.e_rms for run in result.runs}
    assert min(e["pd_link"], e["pd_link_gravity"]) > max(e["pd_both"], e["pd_motor_friction"])
    assert min(e["pd_both"], e["pd_motor_friction"]) > e["pd_both_friction"] > e["inverse_dynamics"]
    assert [line.split(":")[0] for line in said] == ["PD in q", "PD in q, gravity"]
