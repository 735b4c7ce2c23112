# SPDX-License-Identifier: BSD-3-Clause
"""init finds the currents of motors beside their positions, from bags of a simulated Doggy."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main

CONSTANTS = {"motor_current.torque_per_ampere_joint1": 3.0}
CONSTANTS |= {"motor_current.torque_per_ampere_joint2": 2.0, "motor_current.torque_per_ampere_joint3": 1.5}


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Currents in the messages of the encoders, those of joint2 against the commands."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    doggy = load_robot("doggy")
    source = replace(doggy.motor_encoder.source, field="effort", unit="A", scale=(1.0, -1.0, 1.0))
    sensor = MotorCurrent("motor_current", source, np.full(3, 0.02), doggy.joints)
    own = {name: Parameter(name, value, "N m/A", value, 1.0) for name, value in CONSTANTS.items()}
    robot = replace(doggy, sensors={**doggy.sensors, sensor.name: sensor}, parameters={**doggy.parameters, **own})
    made = simulate(robot, "calibration", 6.0, seed=4)
    folder = tmp_path_factory.mktemp("currents") / "bag"
    write_bag(folder, made.recording, robot)
    return folder


def init(bag, path, *options):
    urdf = load_robot("doggy").tree.urdf
    assert main(["init", str(urdf), str(bag), "-o", str(path), *options]) == 0
    return path.read_text()


def test_currents_are_written_as_a_sensor_that_a_calibration_takes(bag, tmp_path):
    text = init(bag, tmp_path / "robot.yaml", "--unit", "duty")
    assert "kind: motor_current" in text and "scale: [1.0, -1.0, 1.0]" in text
    robot = load_robot(tmp_path / "robot.yaml")
    assert np.all((robot.motor_current.sigmas > 0.015) & (robot.motor_current.sigmas < 0.03))
    for joint in robot.joints:  # k_e = n k_t / R, which Doggy's drives share
        assert robot.parameters[f"motor_current.back_emf_{joint}"].value == pytest.approx(4.696, rel=0.02)
        assert abs(robot.parameters[f"motor_current.offset_{joint}"].value) < 0.01


@pytest.mark.slow
def test_its_calibration_finds_the_torque_of_one_ampere(bag, tmp_path):
    init(bag, tmp_path / "robot.yaml", "--unit", "duty")
    robot = load_robot(tmp_path / "robot.yaml")
    found = calibrate(robot, [read_recording(bag, robot)]).robot
    for name, true in CONSTANTS.items():
        p = found.parameters[name]
        assert abs(p.value - true) < 4.0 * p.sigma and p.sigma < 0.03 * true, (name, p.value, p.sigma)


def test_where_a_command_is_no_voltage_the_efforts_are_left_out_with_a_reason(bag, tmp_path):
    text = init(bag, tmp_path / "robot.yaml", "--unit", "A")
    assert "kind: motor_current" not in text
    assert "not used: /joint_states, effort: what the motors report" in text


def test_efforts_of_other_joints_are_left_out_and_not_for_want_of_volts(bag, tmp_path):
    doggy = load_robot("doggy")
    effort = replace(doggy.motor_encoder.source, field="effort", unit="A")
    sensor = MotorCurrent("motor_current", effort, np.full(3, 0.02), doggy.joints)
    own = {name: Parameter(name, value, "N m/A", value, 1.0) for name, value in CONSTANTS.items()}
    robot = replace(doggy, sensors={**doggy.sensors, sensor.name: sensor}, parameters={**doggy.parameters, **own})
    recording = read_recording(bag, robot)
    stream = recording.streams[sensor.name]
    turned = replace(stream, values=stream.values[:, [1, 2, 0]])
    write_bag(tmp_path / "bag", replace(recording, streams={**recording.streams, sensor.name: turned}), robot)
    text = init(tmp_path / "bag", tmp_path / "robot.yaml", "--unit", "duty")
    assert "kind: motor_current" not in text
    assert "commands and speeds do not explain it as currents of the same joints, in the same order" in text
