# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.errors import RobotError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.command_words import ready_robots

R1 = "value: [[-1, 0, 0], [0, 0, -1], [0, -1, 0]]"
STIFFNESS = "joint1.stiffness: {value: 400.0, unit: N m/rad, prior_sigma: 600.0, published: 187.555}"
BIAS = "bias: {value: [0.04564, 0.00024, -0.02222], prior_sigma: 0.1}"
TOP_KEYS = (
    "expected calibration, command, constants, derived, description, effects, format, gravity, held_at_mean, joints, "
    "locked, locked_springs, model, name, noise, parameters, sensors, urdf"
)

# (what stands in doggy.yaml, what stands there instead, what the user is told)
MISTAKES = [
    ("format: 1", "", "my.yaml: 'format' is missing"),
    ("format: 1", "format: 2", "my.yaml: format 2 is not known; this version reads format 1"),
    ("format: 1", "format: one", "my.yaml: format: expected a finite number, got 'one'"),
    ("format: 1", "format: 1\nbanana: 2", f"my.yaml: unknown key 'banana'; {TOP_KEYS}"),
    ("name: doggy", "name: 3", "my.yaml: name: expected a text, got 3"),
    ("urdf: ready:", "urdf: ready:nowhere/", "the URDF READY/nowhere/doggy/doggy.urdf does not exist; "
     "set `urdf` in the robot file, relative to that file"),
    ("urdf: ready:doggy/", "urdf: ", "the URDF FOLDER/doggy.urdf does not exist; "
     "set `urdf` in the robot file, relative to that file"),
    ("gravity: [0.0, 0.0, 0.0]", "gravity: [0, 0]", "my.yaml: gravity: expected 3 finite numbers, got [0, 0]"),
    ("gravity: [0.0, 0.0, 0.0]", "gravity: '123'", "my.yaml: gravity: expected 3 finite numbers, got '123'"),
    ("gravity:", "gravty:", "my.yaml: 'gravity' is missing; is 'gravty' meant to be it?"),
    ("joints: [joint1, joint2, joint3]", "joints: joint1", "my.yaml: joints: expected a list of names, got 'joint1'"),
    ("joints: [joint1, joint2, joint3]", "joints: [joint1, joint1]",
     "my.yaml: joints: expected different names, got joint1, joint1"),
    ("joints: [joint1, joint2, joint3]", "joints: [joint1, joint2, elbow]",
     "doggy.urdf has no moving joint 'elbow'; it has joint1, joint2, joint3"),
    ("coriolis: true", "coriollis: true", "my.yaml: model: unknown key 'coriollis'; did you mean 'coriolis'?"),
    ("coriolis: true", "coriolis: maybe", "my.yaml: model.coriolis: expected true or false, got 'maybe'"),
    ("integrator: simpson", "integrator: rk4",
     "my.yaml: model.integrator: expected one of euler, midpoint, simpson, got 'rk4'"),
    ("friction_sharpness: 200.0", "friction_sharpness: -1",
     "my.yaml: model.friction_sharpness: expected a number above zero, got -1"),
    ("motor.supply_voltage: 32.0", "motor.suply_voltage: 32.0",
     "my.yaml: constants: unknown key 'motor.suply_voltage'; did you mean 'motor.supply_voltage'?"),
    ("motor.supply_voltage: 32.0", "motor.supply_voltage: high",
     "my.yaml: constants.motor.supply_voltage: expected a finite number, got 'high'"),
    ("  motor.supply_voltage: 32.0", "",
     "my.yaml: constants: 'motor.supply_voltage' is missing; a duty cycle needs it"),
    ("unit: duty", "unit: percent", "my.yaml: command.unit: expected one of duty, V, A, N m, got 'percent'"),
    ("topic: /motor_command", "topics: /motor_command",
     "my.yaml: command: 'topic' is missing; is 'topics' meant to be it?"),
    ("topic: /motor_command", "topic: /motor_command\n  names: [a, b]",
     "my.yaml: command.names: expected 3 names, one per joint, got 2"),
    ("unit: rad\n", "unit: grad\n", "my.yaml: sensors.motor_encoder.unit: "
     "expected one of rad, deg, turn, m, mm, rad/s, deg/s, rpm, duty, V, A, mA, N m, m/s^2, g, got 'grad'"),
    ("unit: rad\n", "unit: V\n", "my.yaml: sensors.motor_encoder.unit: "
     "an encoder measures an angle or a length, got 'V'"),
    ("unit: rad/s\n", "unit: rad\n", "my.yaml: sensors.imu1.unit: a gyroscope measures an angular rate, got 'rad'"),
    ("kind: motor_encoder", "kind: encoder",
     "my.yaml: sensors.motor_encoder.kind: expected one of motor_encoder, link_encoder, joint_torque, "
     "motor_current, gyro, accelerometer, position_target, got 'encoder'"),
    ("sigma: 6.9259e-5", "sigma: 0", "my.yaml: sensors.motor_encoder.sigma: expected a number above zero, got 0"),
    ("sigma: 6.9259e-5", "sigma: .nan", "my.yaml: sensors.motor_encoder.sigma: expected a finite number, got nan"),
    ("body: link1", "body: link9", "my.yaml: sensors.imu1.body: no link 'link9'; did you mean 'link3'?"),
    ("form: full", "form: relative", "my.yaml: sensors.imu1: 'reference' is missing"),
    ("form: full", "form: relative\n    reference: imu1",
     "my.yaml: sensors.imu1.reference: expected another gyro (imu2), got 'imu1'"),
    (R1, "value: [[1, 0, 0], [0, 0, -1], [0, -1, 0]]",
     "my.yaml: sensors.imu1.R_imu_body: not a rotation matrix (determinant -1.000); expected R R^T = 1; axes that are "
     "left-handed: negate the first row and set `left_handed: true`"),
    (R1, "value: [[-2, 0, 0], [0, 0, -1], [0, -1, 0]]",
     "my.yaml: sensors.imu1.R_imu_body: not a rotation matrix (determinant 2.000); expected R R^T = 1"),
    (R1, "value: [-1, 0, 0]", "my.yaml: sensors.imu1.R_imu_body.value: expected 3 x 3 finite numbers, got [-1, 0, 0]"),
    (BIAS, "bias: {value: [0, 0]}", "my.yaml: sensors.imu1.bias.value: expected 3 finite numbers, got [0, 0]"),
    (BIAS, "bias: none", "my.yaml: sensors.imu1.bias: expected a mapping, got 'none'"),
    (STIFFNESS, "joint1.stiffness: 400", "my.yaml: parameters.joint1.stiffness: expected a mapping, got 400"),
    (STIFFNESS, "", "my.yaml: parameters: 'joint1.stiffness' is missing"),
    (STIFFNESS, STIFFNESS.replace("stiffness", "stifness"),
     "my.yaml: parameters: unknown parameter 'joint1.stifness'; did you mean 'joint1.stiffness'?"),
    (STIFFNESS, STIFFNESS.replace("N m/rad", "N/m"),
     "my.yaml: parameters.joint1.stiffness.unit: expected 'N m/rad', got 'N/m'"),
    (STIFFNESS, STIFFNESS.replace("400.0", "-400.0"),
     "my.yaml: parameters.joint1.stiffness.value: expected a number above zero, got -400"),
    (STIFFNESS, STIFFNESS.replace("400.0", "'400'"),
     "my.yaml: parameters.joint1.stiffness.value: expected a finite number, got '400'"),
    (STIFFNESS, STIFFNESS.replace("prior_sigma", "prior_sigm"),
     "my.yaml: parameters.joint1.stiffness: unknown key 'prior_sigm'; did you mean 'prior_sigma'?"),
    ("motor.inertia: {", "rotor.inertia: {",
     "my.yaml: parameters: unknown parameter 'rotor.inertia'; did you mean 'motor.inertia'?"),
    ("link_velocity: [0.349, 0.349, 0.349]", "link_velocity: [0.349, 0, 0.349]",
     "my.yaml: noise.link_velocity: expected numbers above zero, got [0.349, 0.0, 0.349]"),
    ("model: integrated", "model: independent", "my.yaml: noise: 'position' is missing"),
    ("model: integrated", "model: integrated\n  lasting_torques: {correlation_time: 0.02}",
     "my.yaml: noise.lasting_torques: 'joint1.link' is missing"),
    ("model: integrated", "model: integrated\n  lasting_torques: {correlation_time: 0.0}",
     "my.yaml: noise.lasting_torques.correlation_time: expected a number above zero, got 0"),
    ("format: 1", "format: 1\nformat: 1",
     'my.yaml is not YAML: line 6, column 1: found duplicate key "format" with value "1" (original value: "1")'),
    ("format: 1", "format: [1", "my.yaml is not YAML: line 6, column 5: expected ',' or ']', but got ':'"),
]  # fmt: skip


def doggy_text():
    """The file of doggy so that it also works elsewhere."""
    return ready_robots()["doggy"].read_text().replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")


def complaint(path) -> str:
    with pytest.raises(RobotError) as error:
        load_robot(path)
    return str(error.value)


@pytest.mark.parametrize(("right", "wrong", "told"), MISTAKES, ids=[told[:70] for *_, told in MISTAKES])
def test_every_mistake_in_a_robot_file_is_named_with_its_place(right, wrong, told, tmp_path):
    text = doggy_text()
    assert right in text
    (tmp_path / "my.yaml").write_text(text.replace(right, wrong, 1))
    ready = str(ready_robots()["doggy"].parents[1])
    assert complaint(tmp_path / "my.yaml").replace(str(tmp_path), "FOLDER").replace(ready, "READY") == told


def test_a_file_for_rests_is_told_what_noise_to_write(tmp_path):
    text = doggy_text().partition("\nnoise:")[0]  # the last section
    (tmp_path / "my.yaml").write_text(f"{text}\n")
    said = complaint(tmp_path / "my.yaml")
    assert said.startswith("my.yaml: 'noise' is missing; write `noise: {estimate: true, link_velocity: [0.35, 0.35, ")
    section = said.partition("`")[2].partition("`")[0]
    (tmp_path / "my.yaml").write_text(f"{text}\n{section}\n")
    assert load_robot(tmp_path / "my.yaml").noise.estimate


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "my.yaml: expected a mapping, got None"),
        (b"- 1\n- 2\n", "my.yaml: expected a mapping, got [1, 2]"),
        (b"\xff\xfe\x00", "FOLDER/my.yaml is not a robot file: it is not text; a robot comes first, then the bag"),
    ],
)
def test_a_file_that_is_something_else_is_refused(content, told, tmp_path):
    (tmp_path / "my.yaml").write_bytes(content)
    assert complaint(tmp_path / "my.yaml").replace(str(tmp_path), "FOLDER") == told


def test_an_unknown_robot_is_answered_with_the_ready_ones():
    assert complaint("dogy") == "no robot 'dogy': neither a file nor a ready robot; did you mean 'doggy'?"
    known = (
        "biorob, biorob_paper, doggy, doggy_paper, hebi_2r, hebi_3r, hebi_5r, kr300, panda, tx90l, tx90l_paper, "
        "xl330_pendulum"
    )
    assert complaint("x") == f"no robot 'x': neither a file nor a ready robot; expected {known}"


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        (
            'izz="0.4702376"',
            'izz="-4.7"',
            "doggy.urdf: link link1, moved by joint1, has a negative inertia: principal moments -4.7, 2, 2 kg m2, mass "
            "1 kg; the mass matrix is not positive definite, so joint1 has no equation of motion. Give what it moves a "
            "<mass> and an <inertia> in the URDF with positive principal moments, none above the sum of the others, or "
            "leave joint1 out of the joints",
        ),
        ("<robot", "<rowboat", None),
    ],
)
def test_an_impossible_rigid_body_is_refused(right, wrong, told, tmp_path):
    urdf = ready_robots()["doggy"].with_name("doggy.urdf").read_text()
    assert right in urdf
    (tmp_path / "doggy.urdf").write_text(urdf.replace(right, wrong, 1))
    (tmp_path / "my.yaml").write_text(ready_robots()["doggy"].read_text())
    message = complaint(tmp_path / "my.yaml")
    assert message == told if told else "is not a URDF that pinocchio can read" in message
    assert "\n" not in message


@pytest.mark.parametrize("name", sorted(ready_robots()))
def test_ready_robots_load_and_describe_themselves(name):
    robot = load_robot(name)
    assert robot.name == name
    assert robot.description


@pytest.mark.parametrize("name", ["doggy", "doggy_paper"])
def test_doggy_has_twelve_parameters_and_nine_channels(name):
    robot = load_robot(name)
    assert len(robot.parameters) == 12
    assert len(robot.channels) == 9


def equation_10(q: np.ndarray) -> np.ndarray:
    """The mass matrix as eq. (10) of Schuethe, Wenk and Frese (2016) prints it.

    Args:
        q: link positions, shape (3,) [rad].

    Returns:
        Shape (3, 3) [kg m2].
    """
    (_, c2, c3), (_, s2, s3) = np.cos(q), np.sin(q)
    m11 = 1.824 * c2 * s2 - 2.975 * c2**2 - 503.760 * c2**2 * c3**2 + 0.106 * c2**2 * c3 * s3
    m11 += 0.183 * c2 * c3 * s2 - 0.138 * c2 * s2 * s3 + 1012.973
    m12 = 0.8192 * s2 - 8.5760 * c2 + 0.0691 * c3 * s2 + 0.0916 * s2 * s3 - 0.1062 * c2 * c3**2
    m12 -= 503.7604 * c2 * c3 * s3
    m13 = 514.2253 * s2 + 0.0916 * c2 * c3 - 0.0691 * c2 * s3
    m22 = 503.7604 * c3**2 - 0.0531 * np.sin(2.0 * q[2]) + 40.0367
    m23 = 0.0691 * c3 + 0.0916 * s3
    return 1e-3 * np.array([[m11, m12, m13], [m12, m22, m23], [m13, m23, 514.2253]])


def test_the_tree_of_doggy_has_the_mass_matrix_of_the_paper():
    rng = np.random.default_rng(10)
    q = rng.uniform(-1.5, 1.5, (50, 3))
    M = load_robot("doggy").tree.mass_matrix(q)
    printed = np.array([equation_10(q_k) for q_k in q])
    assert np.abs(M - printed).max() < 1e-6  # [kg m2], the digits that are printed
