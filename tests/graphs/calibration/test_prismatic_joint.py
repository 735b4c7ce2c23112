# SPDX-License-Identifier: BSD-3-Clause
"""A column that turns and a boom that slides on it: forces and metres beside torques and radians."""

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.units import of_slide
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.init.robot_guess import guess_robot
from jointscope.tools.init.streams.other_joints import Typed
from jointscope.tools.init.text.robot_text import robot_text
from jointscope.tools.simulator import simulate

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

URDF = """<robot name="telescope"><link name="base"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="column"/><axis xyz="0 0 1"/>
 <limit effort="12" velocity="10" lower="-3" upper="3"/></joint>
<link name="column"><inertial><origin xyz="0.1 0 0.2"/><mass value="3"/>
 <inertia ixx="0.12" iyy="0.12" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="reach" type="prismatic"><parent link="column"/><child link="boom"/><origin xyz="0.3 0 0.4"/>
 <axis xyz="1 0 0"/><limit effort="40" velocity="4" lower="-0.5" upper="0.5"/></joint>
<link name="boom"><inertial><origin xyz="0.1 0 0"/><mass value="2"/>
 <inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""

YAML = """
format: 1
name: telescope
urdf: telescope.urdf
gravity: [0.0, 0.0, -9.81]
joints: [turn, reach]
command: {topic: /cmd, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  enc: {kind: motor_encoder, topic: /joint_states, type: sensor_msgs/msg/JointState, field: position,
        unit: [rad, mm], sigma: [7.0e-5, 5.0e-6]}
  imu: {kind: gyro, topic: /imu/data, type: sensor_msgs/msg/Imu, field: angular_velocity, unit: rad/s, body: boom,
        sigma: 5.0e-3, R_imu_body: {value: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}
parameters:
  turn.inertia: {value: 0.3, unit: kg m2}
  reach.inertia: {value: 1.5, unit: kg}
  turn.coulomb_torque: {value: 1.0, unit: N m}
  reach.coulomb_torque: {value: 4.0, unit: N}
  turn.stiffness: {value: 300.0, unit: N m/rad}
  reach.stiffness: {value: 8000.0, unit: N/m}
  turn.damping: {value: 1.0, unit: N m s/rad}
  reach.damping: {value: 10.0, unit: N s/m}
noise: {link_velocity: [0.3, 0.3], motor_velocity: [0.3, 0.3]}
"""
FAR = 1.4  # times the truth: where the calibration starts


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("telescope")
    (folder / "telescope.urdf").write_text(URDF)
    (folder / "telescope.yaml").write_text(YAML)
    return folder


@pytest.fixture(scope="module")
def telescope(folder):
    return load_robot(folder / "telescope.yaml")


@pytest.fixture(scope="module")
def clean(telescope):
    return simulate(telescope, "calibration", 6.0, 1, friction="smooth").recording


@pytest.mark.slow
def test_a_calibration_finds_masses_and_stiffness_of_a_slide(telescope, clean):
    start = telescope.with_values({name: FAR * p.value for name, p in telescope.parameters.items()})
    result = calibrate(start, [clean])
    for name, truth in telescope.parameters.items():
        found = result.robot.parameters[name]
        assert found.value == pytest.approx(truth.value, rel=0.02), name
        assert abs(found.value - truth.value) < 5.0 * found.sigma, name
    assert result.channels["reach.motor_position"].unit == "m"
    assert result.channels["reach.motor_position"].rmse == pytest.approx(5.0e-6, rel=0.1)
    assert result.robot.noise.motor_velocity[1] < 1e-3  # finer than the smallest of a joint that turns


@pytest.mark.slow
def test_friction_of_a_slide_comes_first_and_explains_it(telescope):
    hidden = ["link_viscous@reach:coefficient=3"]
    recording = simulate(telescope, "calibration", 6.0, 3, effects=hidden, friction="smooth").recording
    found = diagnose(telescope, [recording], leaders=1, missing_torque=False)
    first = found.candidates[0]
    assert (first.label, first.verdict) == ("link_viscous@reach", "missing")
    assert first.parameters["coefficient"].unit == "N s/m"
    assert first.parameters["coefficient"].value == pytest.approx(3.0, rel=0.02)


def test_a_bag_keeps_millimetres(telescope, clean, folder):
    write_bag(folder / "mm.mcap", clean, telescope)
    read = read_recording(folder / "mm.mcap", telescope)
    raw = load_robot_text(folder, "unit: [rad, mm]", "unit: [rad, m]")
    in_metres = read_recording(folder / "mm.mcap", raw)
    np.testing.assert_allclose(read.streams["enc"].values, clean.streams["enc"].values, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(in_metres.streams["enc"].values[:, 1], 1e3 * read.streams["enc"].values[:, 1])


def test_units_of_effects_are_those_of_a_slide(telescope):
    robot = telescope
    for effect_id in ("link_viscous", "backlash", "load_dependent_friction", "spring_cubic", "motor_stribeck"):
        robot = add_effect(robot, f"{effect_id}@reach")
    units = {name: p.unit for name, p in robot.parameters.items() if name.count(".") == 2}
    assert units == {
        "reach.link_viscous.coefficient": "N s/m",
        "reach.backlash.half_gap": "m",
        "reach.load_dependent_friction.coefficient": "1",
        "reach.spring_cubic.stiffness": "N/m^3",
        "reach.motor_stribeck.torque": "N",
        "reach.motor_stribeck.velocity": "m/s",
    }


@pytest.mark.parametrize("effect_id", ["bearing_flexibility", "gravity_imbalance", "inertia_error", "payload"])
def test_effects_of_turning_do_not_act_on_a_slide(telescope, effect_id):
    assert "reach" not in catalogue()[effect_id].owners_of(telescope)


def load_robot_text(folder, before, after):
    assert YAML.count(before) == 1
    (folder / "other.yaml").write_text(YAML.replace(before, after))
    return load_robot(folder / "other.yaml")


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("unit: [rad, mm]", "unit: rad", "sensors.enc.unit: reach is prismatic in telescope.urdf; expected m or mm"),
        (
            "unit: [rad, mm]",
            "unit: mm",
            "turn is no prismatic joint in telescope.urdf; expected rad, deg or turn",
        ),
        ("unit: [rad, mm]", "unit: [rad]", "expected one unit or 2 of rad, deg, turn, m, mm"),
        ("unit: [rad, mm]", "unit: [rad, V]", "an encoder measures an angle or a length, got 'V'"),
        ("unit: [rad, mm]", "unit: [rad, inch]", "got 'inch'"),
        ("[7.0e-5, 5.0e-6]", "[7.0e-5]", "sensors.enc.sigma: expected 2 finite numbers"),
        ("[7.0e-5, 5.0e-6]", "[7.0e-5, 0.0]", "sensors.enc.sigma: expected numbers above zero"),
        ("unit: N/m}", "unit: N m/rad}", "parameters.reach.stiffness.unit: expected 'N/m', got 'N m/rad'"),
    ],
)
def test_mistakes_are_named(folder, before, after, message):
    with pytest.raises(RobotError, match=None) as error:
        load_robot_text(folder, before, after)
    assert message in str(error.value)


def test_init_writes_a_unit_for_each_joint(telescope, clean, folder):
    write_bag(folder / "guess.mcap", clean, telescope)
    text = robot_text(guess_robot(Typed(folder / "telescope.urdf", folder / "guess.mcap")), "telescope.urdf")
    (folder / "guess.yaml").write_text(text)
    guessed = load_robot(folder / "guess.yaml")
    assert guessed.motor_encoder.source.units == ("rad", "mm")
    assert guessed.motor_encoder.units == ("rad", "m")
    assert guessed.motor_encoder.sigmas[1] == pytest.approx(5e-6, rel=0.3)
    assert guessed.parameters["reach.inertia"].unit == "kg"


def test_powers_of_radians_become_metres():
    assert [of_slide(u) for u in ("N m/rad^3", "rad/(N m)", "s", "1")] == ["N/m^3", "m/N", "s", "1"]
