# SPDX-License-Identifier: BSD-3-Clause
"""One joint that no weight moves: its inertia and its torques have one common factor, which no recording tells.

A clean recording with measured efforts must not be told that a link weighs something else.
"""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.score_columns import regressors_of
from jointscope.graphs.scoring.score_system import Segment, rows_in_time
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.verdicts.judgement import judge

TRUE = {"torque_constant": 2.0, "coulomb_torque": 0.5, "motor_viscous.coefficient": 0.4}
INERTIA, NOISE = 0.54, 1.4e-5  # [kg m2] of link and rotor together; [rad]
FINE = 5e-5  # [s] steps of the simulation, at the most

URDF = """<robot name="planar"><link name="base"/><link name="upper"><inertial><origin xyz="0.3 0 0"/>
<mass value="4.0"/><inertia ixx="0.1" iyy="0.1" izz="0.13" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-3.1" upper="3.1" effort="50" velocity="20"/></joint></robot>"""
ROBOT = """format: 1
name: planar
urdf: planar.urdf
gravity: [0.0, 0.0, -9.81]
joints: [shoulder]
model: {integrator: simpson, coriolis: true, rigid_joints: [shoulder]}
command: {topic: /joint_states, type: sensor_msgs/msg/JointState, field: effort, unit: A}
sensors:
  motor_encoder: {kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position,
    unit: rad, sigma: 1.4e-5}
parameters:
  shoulder.coulomb_torque: {value: 0.8, unit: N m, prior_sigma: 1.6}
  shoulder.inertia: {value: 0.05, unit: kg m2, fixed: true}
  shoulder.torque_constant: {value: 1.0, unit: N m/A, prior_sigma: 2.0}
  shoulder.motor_viscous.coefficient: {value: 0.5, unit: N m s/rad, prior: 0.0, prior_sigma: 50.0, positive: false,
    'null': 0.0}
noise: {estimate: true, link_velocity: [0.35], motor_velocity: [0.26]}
effects: [motor_viscous@shoulder]
"""


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    (folder / "planar.urdf").write_text(URDF)
    (folder / "planar.yaml").write_text(ROBOT)
    return load_robot(folder / "planar.yaml")


def recorded(rate: float, seconds: float) -> Recording:
    """A joint with dry friction that stops it, in small steps; currents and noisy angles as they are at each sample."""
    rng, fine = np.random.default_rng(1), int(np.ceil(1.0 / (rate * FINE)))
    h, t = 1.0 / (rate * fine), np.arange(int(seconds * rate) * fine) / (rate * fine)
    waves = (rng.uniform(0.8, 1.6) * np.sin(2.0 * np.pi * f * t) for f in (0.4, 0.9, 1.7, 2.9))
    u, q, angle, v = sum(waves) * np.clip(t / 0.5, 0.0, 1.0), np.zeros(len(t)), 0.0, 0.0
    for i, current in enumerate(u):
        q[i] = angle
        torque = TRUE["torque_constant"] * current - TRUE["motor_viscous.coefficient"] * v
        free, stop = v + h * torque / INERTIA, h * TRUE["coulomb_torque"] / INERTIA
        after = np.sign(free) * max(abs(free) - stop, 0.0)
        angle, v = angle + 0.5 * h * (v + after), after
    t, u, q = t[::fine], u[::fine], q[::fine]
    read = (q + NOISE * rng.standard_normal(len(q)))[:, None]
    streams = {
        "command": Stream("command", t, u[:, None], ("shoulder.command",), "A"),
        "motor_encoder": Stream("motor_encoder", t, read, ("shoulder.motor_position",), "rad"),
    }
    return Recording("made.mcap", "", 0, streams)


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
def test_measured_efforts_of_a_clean_recording_are_not_doubted(robot, rate):
    result = calibrate(robot, [recorded(rate, 6.0)])
    judgement = judge(result)
    assert judgement.level == "good", judgement.answer
    for name, value in TRUE.items():
        found = next(p for p in result.parameters if p.name == f"shoulder.{name}")
        assert abs(found.value - value) < max(3.0 * found.sigma, 2e-3 * value), name


def test_the_column_of_a_mass_is_exactly_that_of_all_torques_together(robot):
    known = robot.with_values({f"shoulder.{name}": value for name, value in TRUE.items()})
    problem = BagProblem.of(known, recorded(100.0, 2.0))
    result = calibrate(known, [problem.recording])
    segment = Segment.of(problem, result.bags[0].states, result.bags[0].calibration)
    here = EffectAt(catalogue()["link_mass"], "shoulder")
    mass = EffectHypothesis(here, here.effect.parameters_at(known, "shoulder")[:1])
    calibration = segment.calibration
    torques = np.where(calibration.positive, 1.0, calibration.values)  # one percent more of each
    seen = 0
    for part in rows_in_time(segment, regressors_of(mass, segment)):
        if "dynamics" in part.by_block:
            column, scale = part.by_size[:, :, 0], part.by_block["dynamics"] @ torques
            np.testing.assert_allclose(column, -(0.49 / 4.0 / INERTIA) * scale, atol=1e-4 * np.abs(column).max())
            seen += 1
    assert seen
