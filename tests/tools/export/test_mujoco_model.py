# SPDX-License-Identifier: BSD-3-Clause
"""Robots as MuJoCo models against the equations that they were calibrated with."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp
from tilted_arm import arm_with

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effects_at_once import add_effects
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import with_sigmas
from jointscope.tools.export.mujoco_model import _possible, mujoco_model
from jointscope.tools.export.urdf_model import urdf_model

mujoco = pytest.importorskip("mujoco", reason="MuJoCo models need the extra jointscope[sim]")

SIX_DIGITS = 1e-5  # the engine saves numbers with six
HELD = {
    "joint1.bearing_flexibility.compliance_x": 4e-4,
    "joint1.bearing_flexibility.compliance_y": 3e-4,
    "joint1.bearing_flexibility.damping_x": 10.0,
    "joint1.bearing_flexibility.damping_y": 11.0,
    "joint3.payload.inertia": 0.05,
    "joint2.spring_cubic.stiffness": 3000.0,
    "joint1.motor_viscous.coefficient": 1.0,
    "joint3.link_viscous.coefficient": 2.0,
    "joint2.gravity_imbalance.cos": 1.0,
    "joint2.gravity_imbalance.sin": -2.0,
    "joint1.torque_offset.torque": 0.7,
}


DOGGY = load_robot("doggy")
SLIDE_URDF = """<robot name="slide"><link name="base"/>
<link name="table"><inertial><mass value="12"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="carriage" type="prismatic"><parent link="base"/><child link="table"/><origin rpy="0 0.5 0"/>
<axis xyz="1 0 0"/><limit lower="-0.1" upper="0.4" effort="400" velocity="1"/></joint></robot>"""
SLIDE = """format: 1
name: slide
urdf: slide.urdf
gravity: [0.0, 0.0, -9.81]
joints: [carriage]
command: {topic: /motor_command, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  motor_encoder: {kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position, unit: m,
                  sigma: 2.0e-8}
parameters:
  carriage.coulomb_torque: {value: 15.0, unit: N, prior_sigma: 30.0}
  carriage.inertia: {value: 40.0, unit: kg, prior_sigma: 80.0}
  carriage.stiffness: {value: 4.0e4, unit: N/m, prior_sigma: 8.0e4}
  carriage.damping: {value: 300.0, unit: N s/m, prior_sigma: 600.0}
noise: {estimate: true, link_velocity: [0.35], motor_velocity: [0.26]}
"""


def with_effects(robot: Robot, values: dict[str, float]) -> Robot:
    labels = dict.fromkeys("{1}@{0}".format(*name.split(".")) for name in values)
    return add_effects(robot, list(labels)).robot.with_values(values)


def robot_named(name: str, folder) -> Robot:
    if name == "doggy and effects":
        return with_effects(DOGGY, HELD)
    if name == "arm with a spring found":
        return with_effects(
            arm_with(folder), {"elbow.joint_elasticity.compliance": 1e-3, "elbow.joint_elasticity.damping": 2.0}
        )
    return {"doggy": DOGGY, "arm": arm_with(folder), "arm in A": arm_with(folder, ("elbow",), "A")}[name]


def engine_of(robot: Robot):
    """The engine with the exported model, and where a state's positions and velocities are in it."""
    model = mujoco.MjModel.from_xml_string(mujoco_model(robot).text)
    names = [*robot.layout.links, *(f"{joint}.motor" for joint in robot.layout.motors)]
    return model, mujoco.MjData(model), np.array([model.joint(name).dofadr[0] for name in names])


def equations_of(robot: Robot):
    equations = ElasticJoints(robot)
    values = np.array([robot.parameter(name).value for name in equations.names])
    return lambda x, u: equations.accelerations(x[None], u[None], values)[0]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["doggy", "doggy and effects", "arm", "arm in A", "arm with a spring found"])
def test_accelerations_are_those_of_the_calibrated_model(name, seed, tmp_path):
    robot = robot_named(name, tmp_path)
    robot = robot.with_values({f"{joint}.coulomb_torque": 1e-12 for joint in robot.joints})
    model, data, place = engine_of(robot)
    rng, layout = np.random.default_rng(seed), robot.layout
    x, u = rng.uniform(-0.8, 0.8, layout.size), rng.uniform(-0.5, 0.5, robot.n)
    data.qpos[place], data.qvel[place], data.ctrl[:] = x[layout.positions], x[layout.velocities], u
    mujoco.mj_forward(model, data)
    expected = equations_of(robot)(x, u)
    np.testing.assert_allclose(data.qacc[place], expected, rtol=0, atol=SIX_DIGITS * np.abs(expected).max())


def coupled(_) -> Robot:
    """Ropes over several joints; the friction that grows with the load has no element in the engine."""
    robot = load_robot("biorob")
    return robot.with_values({name: 1e-12 for name in robot.parameters if "weight_dependent" in name})


def sliding(folder) -> Robot:
    (folder / "slide.urdf").write_text(SLIDE_URDF, encoding="utf-8")
    (folder / "slide.yaml").write_text(SLIDE, encoding="utf-8")
    return load_robot(folder / "slide.yaml")


def mimicking(folder) -> Robot:
    """A knee, a tail and a slide that follow joints of the robot."""
    text = DOGGY.path.read_text(encoding="utf-8")
    urdf = Path(__file__).parents[2] / "graphs" / "mimicking_doggy.urdf"
    (folder / "mimicking.yaml").write_text(re.sub(r"(?m)^urdf:.*$", f"urdf: {urdf}", text), encoding="utf-8")
    return load_robot(folder / "mimicking.yaml")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "make, exact",
    [(coupled, SIX_DIGITS), (sliding, SIX_DIGITS), (mimicking, 2e-3)],  # the engine holds followers by stiff springs
)
def test_coupled_sliding_and_mimicking_joints_accelerate_as_in_the_calibrated_model(make, exact, seed, tmp_path):
    robot = make(tmp_path)
    robot = robot.with_values(
        {f"{joint}.coulomb_torque": 1e-12 for joint in robot.joints if f"{joint}.coulomb_torque" in robot.parameters}
    )
    model, data, place = engine_of(robot)
    model.jnt_limited[:] = 0  # a slide has few centimetres; the equations know no end stops
    rng, layout = np.random.default_rng(seed), robot.layout
    x, u = rng.uniform(-0.3, 0.3, layout.size), rng.uniform(-0.5, 0.5, robot.n)
    data.qpos[place], data.qvel[place], data.ctrl[:] = x[layout.positions], x[layout.velocities], u
    for follower, leads, (offset, slope, *_) in zip(model.eq_obj1id, model.eq_obj2id, model.eq_data, strict=True):
        data.qpos[follower], data.qvel[follower] = offset + slope * data.qpos[leads], slope * data.qvel[leads]
    assert bool(model.neq) == (make is mimicking)
    mujoco.mj_forward(model, data)
    expected = equations_of(robot)(x, u)
    np.testing.assert_allclose(data.qacc[place], expected, rtol=0, atol=exact * np.abs(expected).max())


def test_pinocchio_reads_masses_damping_and_armatures_of_rigid_joints(tmp_path):
    text = mujoco_model(arm_with(tmp_path)).text
    path = tmp_path / "exported.xml"
    path.write_text(text, encoding="utf-8")
    engine, read = mujoco.MjModel.from_xml_string(text), pin.buildModelFromMJCF(str(path))
    place = [read.idx_vs[read.getJointId(engine.joint(k).name)] for k in range(engine.njnt)]
    assert pin.computeTotalMass(read) == pytest.approx(engine.body_mass.sum(), rel=SIX_DIGITS)
    np.testing.assert_allclose(np.array(read.damping)[place], engine.dof_damping, rtol=SIX_DIGITS)
    np.testing.assert_allclose(np.array(read.armature)[place], engine.dof_armature, rtol=SIX_DIGITS)
    assert not engine.actuator_armature.any()


def test_a_motion_with_dry_friction_is_that_of_the_calibrated_model(tmp_path):
    robot = with_effects(arm_with(tmp_path), {"shoulder.motor_viscous.coefficient": 1.5})
    model, data, place = engine_of(robot)
    layout, accelerations = robot.layout, equations_of(robot)

    def command(time: float) -> np.ndarray:
        return np.array([25.0 * np.sin(9.0 * time), 12.0 * np.cos(7.0 * time)])

    def rates(time: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[layout.velocities], accelerations(x, command(time))])

    start = np.zeros(layout.size)
    start[layout.positions] = 0.4, -0.3
    seconds = 0.5  # after it the arm has fallen onto its end stop
    end = solve_ivp(rates, (0.0, seconds), start, method="LSODA", rtol=1e-8, atol=1e-9).y[:, -1]
    data.qpos[place] = start[layout.positions]
    while data.time < seconds - 0.5 * model.opt.timestep:
        data.ctrl[:] = command(data.time + 0.5 * model.opt.timestep)
        mujoco.mj_step(model, data)
    moved = np.abs(end[layout.positions] - start[layout.positions])
    assert moved.max() > 0.3
    np.testing.assert_allclose(data.qpos[place], end[layout.positions], atol=0.005 * moved.max())


def test_ranges_torques_and_sensors_come_from_the_urdf_and_the_robot_file():
    model, data, place = engine_of(DOGGY)
    ranges = np.array([model.joint(joint).range for joint in DOGGY.joints])
    np.testing.assert_allclose(ranges, DOGGY.tree.limits, rtol=SIX_DIGITS)
    efforts = np.array([model.jnt_actfrcrange[model.joint(f"{joint}.motor").id, 1] for joint in DOGGY.joints])
    np.testing.assert_allclose(efforts, DOGGY.tree.effort_limits)
    data.qvel[place[1]] = 0.7  # the link of joint 2, about y of the base
    mujoco.mj_forward(model, data)
    omega_body, *_ = DOGGY.tree.body_rate("link3", np.zeros((1, 3)), np.array([[0.0, 0.7, 0.0]]))
    (imu2,) = (gyro for gyro in DOGGY.gyros if gyro.name == "imu2")
    np.testing.assert_allclose(data.sensor("imu2").data, imu2.R_imu_body @ omega_body[0], atol=1e-5)


def test_what_the_engine_has_no_element_for_is_said_and_not_in_the_model():
    robot = with_effects(DOGGY, HELD)
    more = ["backlash@joint3", "motor_stribeck@joint1", "command_delay@robot", "gyro_delay@imu1"]
    exported, known = mujoco_model(add_effects(robot, more).robot), mujoco_model(robot)
    assert exported.text == known.text
    assert set(more) == set(exported.lacks) - set(known.lacks)
    assert "mjcb_passive" in exported.lacks["backlash@joint3"]
    assert "before the drive" in exported.lacks["command_delay@robot"]
    assert "sensor" in exported.lacks["gyro_delay@imu1"]


@pytest.mark.parametrize("name, words", [("kr300", "link_dynamics: free"), ("tx90l", "describes poses")])
def test_a_robot_without_equations_of_motion_is_refused(name, words):
    with pytest.raises(RobotError, match=words):
        mujoco_model(load_robot(name))


def test_a_flat_body_is_still_one_after_rounding_to_six_digits():
    """A thin plate's inertias obey A + B = C exactly; as saved, C can be the larger."""
    plate = np.array([0.0105193, 0.00853439, 0.0019849])
    body = '<body><joint/><inertial pos="0 0 0" mass="2" diaginertia="{} {} {}"/></body>'
    text = f"<mujoco><worldbody>{body}</worldbody></mujoco>"
    saved = text.format(*plate)
    with pytest.raises(ValueError, match="A \\+ B >= C"):
        mujoco.MjModel.from_xml_string(saved)
    found = mujoco.MjModel.from_xml_string(_possible(saved)).body_inertia[1]
    np.testing.assert_allclose(np.sort(found), np.sort(plate), rtol=2 * SIX_DIGITS)
    sound = text.format(0.3, 0.2, 0.15)
    assert _possible(sound) == sound


def test_limits_of_the_urdf_that_bound_the_drives_are_said(tmp_path):
    said = mujoco_model(arm_with(tmp_path)).lacks["torques beyond the limits of the URDF"]
    assert "shoulder 80 N m, elbow 40 N m" in said and "actuatorfrcrange" in said


def test_friction_that_noise_took_below_zero_is_zero_in_both_files_and_said(tmp_path):
    robot = with_effects(arm_with(tmp_path), {"elbow.motor_viscous.coefficient": -4e-6})
    name = "elbow.motor_viscous.coefficient"
    known = replace(robot, parameters=with_sigmas(robot.parameters, {name: 9e-5}))
    said = (f"{name}: below zero by noise, 0 in the file",)
    exported = mujoco_model(known)
    assert exported.warnings == said
    assert engine_of(known)[0].joint("elbow").damping == 0.0
    urdf = urdf_model(known)
    assert urdf.warnings[:1] == said and 'damping="0"' in urdf.text and 'damping="-' not in urdf.text
    surely = replace(robot, parameters=with_sigmas(robot.parameters, {name: 1e-7}))
    with pytest.raises(RobotError, match=rf"{name} is -4e-06 N m s/rad, .* `jointscope remove .* motor_viscous@elbow"):
        mujoco_model(surely)
    with pytest.raises(RobotError, match=name):
        urdf_model(surely)
