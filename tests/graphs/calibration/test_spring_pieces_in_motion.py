# SPDX-License-Identifier: BSD-3-Clause
"""Two ropes over springs of their own, made by the engine, come out of motion as a curve that is bent at zero."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.effect_kinds.joint_torque import JointSignals
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator import simulate

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
pytestmark = pytest.mark.slow

ROPES = "spring_ropes@joint3:forward_stiffness=2,forward_start=0,backward_stiffness=4,backward_start=0"
AHEAD, BEHIND = 3.0, 5.0  # [N m/rad] of both coils of each rope, 1 N m/rad of which is the joint's own spring


def test_each_rope_has_its_stiffness():
    robot = load_robot("biorob")
    simulation = simulate(robot, "calibration", 4.0, 3, effects=[ROPES])
    result = calibrate(add_effect(robot, "spring_pieces_1@joint3"), [simulation.recording])
    layout, values = result.robot.layout, result.robot.values
    estimates = {p.name: p for p in result.parameters}
    for name, true in (("stiffness", AHEAD), ("spring_pieces_1.turn", BEHIND / AHEAD - 1.0)):
        p = estimates[f"joint3.{name}"]
        assert abs(p.value - true) < max(3.0 * p.sigma, 1e-4 * true) and p.sigma < 0.1 * true
    seen = ElasticJoints(result.robot).seen(simulation.states, values)
    d = seen[:, layout.joint_q[2]] - seen[:, layout.motor_q[2]]
    d = np.linspace(d.min(), d.max(), 101)
    still, K = np.zeros_like(d), values["joint3.stiffness"]
    signals = JointSignals(q_link=d, v_link=still, q_motor=still, v_motor=still, tau_spring=K * d, stiffness=K)
    own = {n.rpartition(".")[2]: v for n, v in values.items() if n.startswith("joint3.spring_pieces_1.")}
    torque = K * d + catalogue()["spring_pieces_1"].law(signals, own)
    true = np.where(d > 0.0, AHEAD, BEHIND) * d
    assert np.max(np.abs(torque - true)) < 0.01 * np.max(np.abs(true))
