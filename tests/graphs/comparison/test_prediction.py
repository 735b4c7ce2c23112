# SPDX-License-Identifier: BSD-3-Clause
"""Predictions take the steps that the moving inertia asks for, agree with small ones, and end if a model runs away."""

from __future__ import annotations

import time
import warnings
from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.comparison import compare as compare_module
from jointscope.graphs.comparison.compare import compare
from jointscope.graphs.comparison.prediction import Predictor
from jointscope.graphs.comparison.runge_kutta import StepCuts, runge_kutta
from jointscope.graphs.problem.timeline import Timeline
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.terminal.comparison_text import comparison_text

CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases"
URDF = """<robot name="arm"><link name="base"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
 <limit effort="60" velocity="10" lower="-3" upper="3"/></joint>
<link name="upper"><inertial><origin xyz="0 0 0.2"/><mass value="3"/>
 <inertia ixx="0.05" iyy="0.05" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.4"/>
 <axis xyz="0 1 0"/><limit effort="30" velocity="10" lower="-3" upper="3"/></joint>
<link name="lower"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
 <inertia ixx="0.01" iyy="0.01" izz="0.005" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
ARM = """
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [shoulder, elbow]
model: {rigid_joints: [shoulder, elbow]}
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  enc: {kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position, unit: rad,
        sigma: 1.0e-5}
parameters:
  shoulder.inertia: {value: INERTIA, unit: kg m2}
  elbow.inertia: {value: INERTIA, unit: kg m2}
  shoulder.coulomb_torque: {value: 2.0, unit: N m}
  elbow.coulomb_torque: {value: 1.0, unit: N m}
  shoulder.motor_viscous.coefficient: {value: VISCOUS, unit: N m s/rad, positive: false}
  elbow.motor_viscous.coefficient: {value: VISCOUS, unit: N m s/rad, positive: false}
effects: [motor_viscous@shoulder, motor_viscous@elbow]
noise: {link_velocity: [0.01, 0.01], motor_velocity: [0.01, 0.01]}
"""


@pytest.fixture
def arm(tmp_path):
    """Makes a rigid arm with given motor inertia [kg m2] and viscous friction [N m s/rad]."""

    def make(inertia=0.02, viscous=0.5):
        (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
        text = ARM.replace("INERTIA", str(inertia)).replace("VISCOUS", str(viscous))
        (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")
        return load_robot(tmp_path / "arm.yaml")

    return make


def swinging(count, h=2.5e-3):
    """Ticks and torques that reverse both joints again and again."""
    ticks = h * np.arange(count + 1)
    t = ticks[:-1, None]
    return Timeline(ticks, np.array([8.0, 3.0]) * np.sin(2.0 * np.pi * np.array([1.3, 2.9]) * t + [0.0, 1.0]))


def in_small_steps(robot, timeline, x, parts=100):
    """The slow reference: the equations with all parameters free, a fixed number of small steps."""
    model = ElasticJoints(robot)
    values = np.array([robot.parameters[name].value for name in model.names])
    path = [x]
    for h, u in zip(timeline.h, timeline.u, strict=True):

        def rate(at, u=u):
            found = np.empty_like(at)
            found[:, model.layout.positions] = at[:, model.layout.velocities]
            found[:, model.layout.rates] = model.accelerations(at, u[None], values)
            return found

        for _ in range(parts):
            x = runge_kutta(rate, x, h / parts)
        path.append(x)
    return np.concatenate(path)


def test_friction_that_is_stiff_is_followed_as_by_small_steps(arm):
    robot, timeline = arm(inertia=0.001), swinging(14)
    cuts = StepCuts(robot, 2.5e-3)
    assert cuts.coarse == 1 and cuts.fine > 10
    start = np.array([0.1, -0.2, 0.15, -0.1])
    reference = in_small_steps(robot, timeline, start[None])
    assert np.any(np.abs(np.diff(np.sign(reference[:, 2]))) > 1)  # friction changes its sign
    found = Predictor(robot, timeline).path(start)
    np.testing.assert_allclose(found[:, :2], reference[:, :2], atol=1e-5)


def test_many_starts_side_by_side_go_where_each_goes_alone(arm):
    robot, timeline = arm(), swinging(80)
    predictor = Predictor(robot, timeline)
    path = predictor.path(np.array([0.1, -0.2, 0.3, 0.0]))
    start = np.array([0, 7, 13, 30])
    for step, _, after in predictor.paths(path[start], start, 50):
        np.testing.assert_allclose(after, path[step + 1], rtol=1e-9, atol=1e-11)


def test_the_motor_of_a_rigid_joint_moves_the_link(arm):
    """Friction over the motor's own inertia would ask for 200 * 2 / 1e-4 * 4e-3 = 16000 steps."""
    assert StepCuts(arm(inertia=1e-4), 4e-3).fine < 320
    assert StepCuts(arm(inertia=1.0), 4e-3).fine < 8


def test_a_model_that_runs_away_ends_without_a_word(arm):
    predictor = Predictor(arm(viscous=-40.0), swinging(4000))
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = predictor.path(np.array([0.1, 0.0, 0.5, 0.0]))
    lost = ~np.isfinite(path).all(axis=1)
    assert lost[-1] and not lost[0]
    assert np.array_equal(lost, np.sort(lost))  # once lost, lost for good
    assert time.process_time() - began < 5.0


def of_case(robot, recording="measured_effort.mcap"):
    if not CASES.is_dir():
        pytest.skip("shared/cases is not beside the project")
    found = load_robot(CASES / robot)
    return found, read_recording(CASES / recording, found)


def test_comparing_a_tiny_motor_inertia_ends_soon():
    robot, recording = of_case("tiny_motor_inertia.yaml")
    began = time.process_time()
    model = compare({"tiny": robot}, recording).models[0]
    assert time.process_time() - began < 20.0  # not done after 240 s when the motor's own inertia counted
    assert np.isfinite(model.error)


def test_the_open_loop_is_predicted_once_and_not_before_somebody_asks(monkeypatch):
    robot, recording = of_case("measured_effort.yaml")
    asked = []
    predict = compare_module.predict_open_loop
    monkeypatch.setattr(compare_module, "predict_open_loop", lambda *args: asked.append(1) or predict(*args))
    model = compare({"arm": robot}, recording).models[0]
    channel = model.channels["shoulder.motor_position"]
    assert list(channel.horizons)[-1] == "open_loop" and channel.horizons["0.1"] > 0.0 and not asked
    assert (
        np.isfinite(channel.horizons["open_loop"])
        and np.isfinite(model.sensors[robot.motor_encoder.name].open_loop).any()
    )
    assert asked == [1]


def test_an_open_loop_that_runs_away_is_said_to_be_infinite():
    robot, recording = of_case("measured_effort.yaml")
    wild = robot.with_values({"shoulder.motor_viscous.coefficient": -200.0})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = compare({"wild": wild}, recording)
    assert result.models[0].channels["shoulder.motor_position"].horizons["open_loop"] == np.inf
    row = next(line for line in comparison_text(result).splitlines() if line.startswith("  shoulder.motor_position"))
    assert "∞" in row


@pytest.mark.parametrize("label", ["backlash@joint1", "spring_slack@joint1"])
def test_a_link_that_falls_through_its_dead_zone_hits_the_edge_as_by_small_steps(label):
    sizes = {"half_gap": 0.1} if label.startswith("backlash") else {"forward": 0.1, "backward": 0.05}
    robot = load_robot("biorob")
    smooth = {name: 0.0 for name in robot.parameters if "coulomb" in name or "weight_dependent" in name}
    robot = add_effect(robot.with_values(smooth), label, sizes)
    x = np.zeros((1, robot.layout.size))
    x[:, robot.layout.q_link] = q = np.array([0.0, -np.pi / 2, 0.0, 0.0])
    x[:, robot.layout.q_motor] = np.linalg.solve(robot.transmission, q)
    x[:, robot.layout.joint_v[0]] = 2.0
    timeline = Timeline(2e-3 * np.arange(61), np.zeros((60, robot.n)))
    reference, predictor = in_small_steps(robot, timeline, x), Predictor(robot, timeline)
    error = np.abs(predictor.path(x[0]) - reference)[:, robot.layout.positions].max()
    predictor._edges = None
    without = np.abs(predictor.path(x[0]) - reference)[:, robot.layout.positions].max()
    assert error < 1e-6 < without
