# SPDX-License-Identifier: BSD-3-Clause
"""No simulated effect is made for Doggy: an arm with gravity, torque commands, turned frames and other names."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tilted_arm import URDF

from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.structured_tree import StructuredTree
from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop
from jointscope.tools.simulator import simulate
from jointscope.tools.simulator.effects import make_effect, simulated_effects
from jointscope.tools.simulator.world.effect import owners_of
from jointscope.tools.simulator.world.engine import Engine

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

UNITS = {"inertia": "kg m2", "coulomb_torque": "N m", "stiffness": "N m/rad", "damping": "N m s/rad"}
VALUES = {"inertia": 0.5, "coulomb_torque": 1.0, "stiffness": 300.0, "damping": 1.0}
PARAMETERS = "".join(
    f"  {joint}.{name}: {{value: {value}, unit: {UNITS[name]}}}\n"
    for joint in ("shoulder", "elbow")
    for name, value in VALUES.items()
)
YAML = f"""
format: 1
name: arm
urdf: arm.urdf
gravity: [0.0, 0.0, -9.81]
joints: [shoulder, elbow]
command: {{topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}}
sensors:
  enc: {{kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: rad, sigma: 1.0e-4}}
  wrist: {{kind: gyro, topic: /wg, type: sensor_msgs/msg/Imu, field: angular_velocity, unit: rad/s, body: fore,
          sigma: 2.0e-3, R_imu_body: {{value: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}}}
parameters:
{PARAMETERS}noise: {{link_velocity: [0.3, 0.3], motor_velocity: [0.3, 0.3]}}
"""


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.urdf").write_text(URDF.format(speed=10))
    (folder / "arm.yaml").write_text(YAML)
    return load_robot(folder / "arm.yaml")


@pytest.mark.parametrize("effect_id", list(simulated_effects()))
def test_every_effect_runs_on_the_arm(arm, effect_id):
    owners = owners_of(simulated_effects()[effect_id].acts_on[0], arm)
    if not owners:
        with pytest.raises(
            EffectError, match=f"{effect_id} cannot act on 'elbow'; it needs a joint seen on the link, and"
        ):
            make_effect(f"{effect_id}@elbow", arm)
        return
    owner = owners[-1]
    simulation = simulate(arm, "moves", 1.0, 1, effects=[f"{effect_id}@{owner}"])
    assert np.isfinite(simulation.states).all()
    assert np.abs(simulation.states).max() < 50


def accelerations(engine: Engine, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    x = np.zeros((2, 4))
    x[:, engine.link], x[:, engine.motor] = (q, v), (q, v)
    return engine.accelerations(*x, np.zeros(2))[engine.link]


@pytest.mark.parametrize("joint", ["shoulder", "elbow"])
def test_an_imbalance_turns_its_own_joint_only(arm, joint):
    effect, rng = make_effect(f"gravity_imbalance@{joint}:cos=-2,sin=5", arm), np.random.default_rng(0)
    for _ in range(5):
        q, v = rng.uniform(-1.5, 1.5, (2, 2))
        change = accelerations(Engine(arm, [effect]), q, v) - accelerations(Engine(arm), q, v)
        own = arm.joints.index(joint)
        expected = np.where(np.arange(2) == own, -2 * np.cos(q[own]) + 5 * np.sin(q[own]), 0.0)
        np.testing.assert_allclose(arm.tree.mass_matrix(q[None])[0] @ change, expected, atol=1e-8)


def test_a_payload_sits_on_the_long_axis_and_has_weight(arm):
    model = arm.tree.model.copy()
    long_axis = np.array([0.0, 1.0, 0.0])
    model.appendBodyToJoint(2, pin.Inertia(0.2, 0.5 * long_axis, np.zeros((3, 3))), pin.SE3.Identity())
    model.gravity = pin.Motion(np.array([0.0, 0.0, -9.81]), np.zeros(3))
    q, v = np.array([0.3, -0.5]), np.array([0.7, 0.4])
    expected = pin.aba(model, model.createData(), q, v, np.zeros(2))
    engine = Engine(arm, [make_effect("payload@elbow:inertia=0.05", arm)])
    np.testing.assert_allclose(accelerations(engine, q, v), expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(
    ("label", "values"),
    [
        ("gravity_direction@robot", {"x": 0.2, "y": -0.1}),
        ("link_mass@shoulder", {"mass": 1.2, "x": 0.01, "y": -0.02, "z": 0.02}),
        ("link_mass@elbow", {"mass": -0.5, "x": 0.005, "y": 0.01, "z": 0.01}),
        ("axis_misalignment@shoulder", {"x": 0.1, "y": -0.2}),
        ("axis_misalignment@elbow", {"x": -0.3, "y": 0.15}),
    ],
)
def test_settings_of_the_simulator_are_those_of_the_catalogue(arm, label, values):
    effect = make_effect(f"{label}:{','.join(f'{name}={value}' for name, value in values.items())}", arm)
    robot = add_effect(replace(arm, sensors={arm.motor_encoder.name: arm.motor_encoder}), label, values)
    bodies = StructuredTree(robot).bodies({name: p.value for name, p in robot.parameters.items()})
    rng = np.random.default_rng(3)
    for _ in range(5):
        q, v = rng.uniform(-1.5, 1.5, (2, 2))
        expected = bodies.acceleration(q[None], v[None], np.zeros((1, 2)))[0]
        np.testing.assert_allclose(accelerations(Engine(arm, [effect]), q, v), expected, rtol=1e-6, atol=1e-6)


def test_a_slanted_robot_is_not_turned_about_axes_that_are_not_level(arm):
    slanted = replace(arm, tree=RigidTree(arm.tree.urdf, arm.joints, np.array([0.0, 3.0, -9.0])))
    with pytest.raises(EffectError, match="needs an upright robot, and there is none"):
        make_effect("gravity_direction@robot", slanted)


def test_without_a_gear_ratio_one_period_per_turn_of_the_joint_is_assumed(arm):
    for effect_id in ("cogging", "encoder_eccentricity"):
        assert make_effect(f"{effect_id}@elbow", arm).parameters["order"] == 1.0


@pytest.mark.slow
def test_state_feedback_from_the_robot_file_alone_moves_the_arm_against_gravity(arm):
    options = LoopOptions(sources=("true",))
    result = run_closed_loop(arm, None, seconds=6.0, seed=1, options=options)
    p, feedback = (result.run(controller, "true").tracking for controller in ("p", "state_feedback"))
    assert feedback.hit_position < 0.05 * p.hit_position
    assert feedback.link_position_rms < 5e-3  # [rad] although the arm sags before it is caught at the start
