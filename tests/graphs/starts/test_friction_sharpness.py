# SPDX-License-Identifier: BSD-3-Clause
"""How sharply dry friction turns over: found where a joint is slow; assumed, it spoils the other values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import SHARP, STEP, Arm, moved, written

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.stages.whole_stage import blunted
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.robot_torque import RobotTorque
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.recordings.recording import Recording

SLIDE = Arm("X", inertia=(0.7,), dry=(2.0,), viscous=(15.0,), gravity=(0.0, 0.0, 0.0))
YAML = """
format: 1
name: lift
urdf: arm.urdf
gravity: [0.0, 0.0, 0.0]
joints: [j0]
model: {rigid_joints: [j0]}
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  encoder: {kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: m, sigma: 5.0e-6}
effects: [motor_viscous@j0]
parameters:
  j0.inertia: {value: 1.0, unit: kg}
  j0.coulomb_torque: {value: 1.0, unit: N}
  j0.motor_viscous.coefficient: {value: 5.0, unit: N s/m, prior: 0.0, prior_sigma: 100.0, positive: false}
  # sharpness
noise: {link_velocity: [0.3], motor_velocity: [0.3]}
"""
FREE = "j0.friction_sharpness: {value: 100.0, unit: s/m, prior_sigma: 200.0}"


@pytest.fixture
def lift(tmp_path):
    def make(sharpness=""):
        written(SLIDE, tmp_path)
        (tmp_path / "lift.yaml").write_text(YAML.replace("# sharpness", sharpness))
        return load_robot(tmp_path / "lift.yaml")

    return make


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
def test_a_calibration_finds_how_sharply_the_dry_friction_of_a_slow_slide_turns_over(lift, rate):
    encoder, command = moved(SLIDE, noise=5e-6, encoder_rate=rate, command_rate=rate)
    recording = Recording("", "", 10**18, {"encoder": encoder, "command": command})
    found = {name: calibrate(lift(text), [recording]).robot.parameters for name, text in (("free", FREE), ("held", ""))}
    free, held = found["free"], found["held"]
    assert free["j0.friction_sharpness"].value == pytest.approx(SHARP, rel=0.05)
    assert free["j0.coulomb_torque"].value == pytest.approx(2.0, rel=0.003)
    assert free["j0.motor_viscous.coefficient"].value == pytest.approx(15.0, rel=0.005)
    # held at 200 s/m where 400 is true does no harm: speeds at which the two differ are not asked
    assert held["j0.coulomb_torque"].value == pytest.approx(2.0, rel=0.001)
    assert held["j0.motor_viscous.coefficient"].value == pytest.approx(15.0, rel=0.002)


def test_a_slide_that_truly_sticks_is_right_and_its_sharpness_is_held_as_far_as_the_encoder_tells(lift, tmp_path):
    encoder, command = moved(SLIDE, noise=5e-6, sticks=True)
    result = calibrate(lift(FREE), [Recording("", "", 10**18, {"encoder": encoder, "command": command})])
    found = result.robot.parameters
    assert found["j0.coulomb_torque"].value == pytest.approx(2.0, rel=0.001)
    assert found["j0.motor_viscous.coefficient"].value == pytest.approx(15.0, rel=0.002)
    inertia = 0.7 + STEP / 2.0 * 15.0  # MuJoCo damps by the velocity at the end of a step, stamps take half of it back
    assert abs(found["j0.inertia"].value - inertia) < 3.0 * found["j0.inertia"].sigma
    assert found["j0.friction_sharpness"].fixed and found["j0.friction_sharpness"].value > 2.0 * SHARP
    assert any("j0 sticks where it stands" in said for said in result.findings)
    (tmp_path / "found.yaml").write_text(robot_text(result.robot, tmp_path))
    read = load_robot(tmp_path / "found.yaml").parameters["j0.friction_sharpness"]
    assert read.fixed and read.value == pytest.approx(found["j0.friction_sharpness"].value, rel=1e-3)


OWN_LAW = RobotTorque(
    id="own_friction",
    owners=("robot",),
    parameters=(EffectParameter("torque", "N", start=0.7, prior_sigma=3.0),),
    law=lambda s, p: (0.0 * s.v_link, -p["torque"] * np.tanh(s.sharpness * s.v_motor)),
    card=Card(title="own", law="own", explanation="own", source="own", typical="own", excitation="own"),
)


@pytest.mark.parametrize(
    "effect",
    ["", "motor_stribeck", "asymmetric_friction", "link_coulomb", "load_dependent_friction", "own_friction"],
)
def test_slopes_by_the_sharpness_are_those_of_differences(lift, effect):
    robot = lift(FREE)
    if effect == "own_friction":
        own = {"robot.own_friction.torque": Parameter("robot.own_friction.torque", 0.7, "N", 0.0, 3.0, positive=False)}
        robot = replace(
            robot, effects=(*robot.effects, EffectAt(OWN_LAW, "robot")), parameters={**robot.parameters, **own}
        )
    elif effect:
        robot = add_effect(robot, f"{effect}@j0")
    if effect == "load_dependent_friction":  # it needs a load: gravity along the slide
        robot = replace(robot, tree=RigidTree(robot.tree.urdf, robot.joints, np.array([4.0, 0.0, 0.0])))
    joints = ElasticJoints(robot)
    x = np.zeros((3, robot.layout.size))
    x[:, :2] = [[0.1, 0.004], [-0.2, -0.011], [0.0, 0.03]]
    u = np.zeros((3, 1))
    at = {"inertia": 1.3, "coulomb_torque": 2.0, "friction_sharpness": 140.0, "motor_viscous.coefficient": 5.0}
    values = np.array([at.get(name.partition(".")[2], 0.7) for name in joints.names])
    k, step = joints.names.index("j0.friction_sharpness"), 1e-3

    def slopes(of):
        moved_by = np.eye(len(values))[k] * step
        before, after = (of.accelerations(x, u, values + sign * moved_by) for sign in (-1.0, 1.0))
        return (after - before) / (2.0 * step)

    found = joints.with_derivatives(x, u, values).by_parameter[:, :, k]
    np.testing.assert_allclose(found, slopes(joints), rtol=1e-6, atol=1e-10)
    if effect:  # more than that of the base friction alone
        alone = ElasticJoints(lift(FREE))
        some = np.array([at[name.partition(".")[2]] for name in alone.names])
        base = alone.with_derivatives(x[:, :2], u, some).by_parameter[:, 0, alone.names.index("j0.friction_sharpness")]
        assert np.abs(found[:, 0] - base).max() > 0.02 * np.abs(base).max()


def test_stages_with_blunt_friction_leave_a_sharpness_that_is_looked_for(lift):
    encoder, command = moved(SLIDE, noise=5e-6)
    recording = Recording("", "", 10**18, {"encoder": encoder, "command": command})
    for text, expected in ((FREE, 100.0), ("", 20.0)):
        robot = blunted(BagProblem.of(lift(text), recording), 20.0).robot
        assert robot.friction_sharpness().tolist() == [expected]


def test_the_unit_of_the_sharpness_of_a_slide_is_asked_for(lift):
    with pytest.raises(RobotError, match=r"j0.friction_sharpness.unit: expected 's/m', got 's/rad'"):
        lift(FREE.replace("s/m", "s/rad"))
