# SPDX-License-Identifier: BSD-3-Clause
"""Linear models against equations of their own, a feedback designed on one, and the page that says how."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are

import jointscope as js
from jointscope.graphs.fixed_lag.window.state_names import state_names
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effect_editing import add_effect

PAGE = Path(__file__).resolve().parents[3] / "docs" / "linear_models.md"
POSTURE = {"joint1": 0.2, "joint2": 0.5, "joint3": 0.6, "joint4": -0.3}


def values_of(robot, name):
    return np.array([robot.parameters[f"{joint}.{name}"].value for joint in robot.joints])


def doggy_rates(robot, u):
    """Links on springs and motors with dry friction left out, of pinocchio's equations."""
    model = pin.buildModelFromUrdf(str(robot.tree.urdf))
    model.gravity.linear[:] = 0.0
    data, n = model.createData(), 3
    k, d = values_of(robot, "stiffness"), values_of(robot, "damping")
    p = {name: robot.parameters[f"motor.{name}"].value for name in ("k_pwm", "k_mi", "inertia")}

    def rates(x):
        q, v, qm, vm = x[:n], x[n : 2 * n], x[2 * n : 3 * n], x[3 * n :]
        spring = k * (qm - q) + d * (vm - v)
        drive = p["k_pwm"] * 32.0 * u - p["k_mi"] * vm
        return np.concatenate([v, pin.aba(model, data, q, v, spring), vm, (drive - spring) / p["inertia"]])

    return rates


def slopes(f, x, h=1e-6):
    return np.column_stack([(f(x + h * e) - f(x - h * e)) / (2.0 * h) for e in np.eye(len(x))])


def test_it_is_the_slope_of_the_equations_of_motion():
    robot = js.load_robot("doggy")
    model = js.linear_model(robot, {"joint2": 0.4})
    assert model.names[:3] == ("joint1.q_link", "joint2.q_link", "joint3.q_link")
    np.testing.assert_allclose(model.A, slopes(doggy_rates(robot, np.zeros(3)), model.state), atol=2e-5 * 1200.0)
    columns = [(doggy_rates(robot, e)(model.state) - doggy_rates(robot, -e)(model.state)) / 2.0 for e in np.eye(3)]
    np.testing.assert_allclose(model.B, np.column_stack(columns), rtol=1e-9, atol=1e-9)
    assert np.all(np.diff(np.abs(model.poles)) >= 0.0)


def test_springs_that_harden_carry_the_weight_through_the_ropes():
    robot = js.load_robot("biorob")
    model = js.linear_model(robot, POSTURE)
    tree = pin.buildModelFromUrdf(str(robot.tree.urdf))
    q = np.array([POSTURE[joint] for joint in robot.joints])
    weight = pin.computeGeneralizedGravity(tree, tree.createData(), q)
    ropes = np.linalg.inv(robot.transmission)  # springs stand in the coordinates of the motors
    deflection = ropes @ q - model.state[robot.layout.q_motor]
    spring = values_of(robot, "stiffness") * deflection
    for j, joint in enumerate(robot.joints):
        for power, name in ((2, "quadratic"), (3, "cubic")):
            p = robot.parameters.get(f"{joint}.spring_curve.{name}")
            spring[j] += 0.0 if p is None else p.value * deflection[j] ** power
    np.testing.assert_allclose(-ropes.T @ spring, weight, atol=1e-8)
    ahead = js.linear_model(robot, {**POSTURE, "joint2": POSTURE["joint2"] + 1e-4})
    behind = js.linear_model(robot, {**POSTURE, "joint2": POSTURE["joint2"] - 1e-4})
    still = model.A @ (ahead.state - behind.state) + model.B @ (ahead.command - behind.command)
    np.testing.assert_allclose(still, 0.0, atol=1e-5)  # from one equilibrium to the next nothing accelerates


def test_a_feedback_that_was_designed_on_it_holds_the_arm():
    robot = js.load_robot("doggy")
    model = js.linear_model(robot, {"joint2": 0.4})
    R = np.diag(np.full(3, 25.0))
    K = np.linalg.solve(R, model.B.T @ solve_continuous_are(model.A, model.B, np.eye(12) * 100.0, R))
    start = model.state + np.repeat([0.1, 0.0, 0.1, 0.0], 3)

    def closed(_, x):
        return doggy_rates(robot, model.command - K @ (x - model.state))(x)

    end = solve_ivp(closed, (0.0, 6.0), start, rtol=1e-7).y[:, -1]
    assert np.max(np.abs(end - model.state)) < 1e-3


def test_a_rigid_joint_has_no_motor_of_its_own():
    robot = js.load_robot("doggy")
    robot = replace(robot, choices=replace(robot.choices, rigid_joints=("joint1",)))
    model = js.linear_model(robot)
    assert model.A.shape == (10, 10) and model.B.shape == (10, 3)
    assert "joint1.q_motor" not in model.names


def test_the_lag_of_an_encoder_with_play_is_no_part_of_it():
    robot = add_effect(js.load_robot("doggy"), "hysteresis@joint1")
    model = js.linear_model(robot, {"joint2": 0.4})
    lagging = add_effect(add_effect(js.load_robot("doggy"), "encoder_hysteresis@joint2"), "hysteresis@joint1")
    seen = js.linear_model(lagging, {"joint2": 0.4})
    np.testing.assert_allclose(seen.A, model.A, atol=1e-9)
    np.testing.assert_allclose(seen.B, model.B, atol=1e-9)
    assert seen.names == model.names and seen.names[-1] == "hysteresis@joint1.memory"
    whole = state_names(lagging.layout)
    assert tuple(whole[i] for i in seen.rows) == seen.names
    assert set(whole) - set(seen.names) == {"encoder_hysteresis@joint2.memory"}


def test_a_joint_that_is_not_there_is_named():
    with pytest.raises(RobotError, match="no joint 'elbow'; expected some of joint1, joint2, joint3"):
        js.linear_model(js.load_robot("doggy"), {"elbow": 0.1})


@pytest.mark.slow
def test_the_page_works_and_a_sweep_agrees(tmp_path, capsys):
    text = PAGE.read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    names: dict = {}
    exec(compile(code, PAGE.name, "exec"), names)
    assert names["closed"].real.max() < 0.0 and "poles:" in capsys.readouterr().out
    (block,) = re.findall(r"```bash\n(.*?)```", text, re.DOTALL)
    from page_commands import lines_of, run

    for command in lines_of(block):
        assert run(command, tmp_path).returncode == 0
    swept = np.load(tmp_path / "shaken.npz")
    lines = (swept["frequency_hz"] > 15.0) & (swept["frequency_hz"] < 60.0)
    model, robot = js.linear_model(names["robot"]), names["robot"]
    own = np.diagonal(model.response(swept["frequency_hz"][lines])[:, robot.layout.q_motor], axis1=1, axis2=2)
    seen = np.diagonal(swept["response"][lines], axis1=1, axis2=2)
    assert np.median(np.abs(seen / own - 1.0)) < 0.06
