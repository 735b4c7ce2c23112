# SPDX-License-Identifier: BSD-3-Clause
"""Measured currents beside commands: MuJoCo's actuators wound to a data sheet, and a BioRob made elsewhere."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.factors.driven import DrivenFactor
from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.fixed_lag.replay.replay import replay
from jointscope.graphs.problem.sensor_placement import factor_on_state
from jointscope.graphs.screening.current_delay import current_gap, with_current_delay
from jointscope.graphs.screening.mistaken_currents import mistaken_currents
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.effects.command_delay import EFFECT as COMMAND_DELAY
from jointscope.robots.errors import RobotError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.readings_at_one_state import ReadingsAtOneState
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.verdicts.currents_and_volts import NAME
from jointscope.tools.verdicts.judgement import judge

SIGMA = 0.02  # [A]
TRUE = {
    "current.torque_per_ampere_joint1": 3.0,
    "current.torque_per_ampere_joint2": 2.0,
    "current.torque_per_ampere_joint3": 1.5,
    "current.offset_joint2": 0.1,
}
SENSOR = """
  current:
    kind: motor_current
    topic: /currents
    type: sensor_msgs/msg/JointState
    field: effort
    unit: mA
    sigma: [0.02, 0.03, 0.04]
    delay: {value: 0.003}
"""
DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "biorob" / "clean"


def with_currents(robot, delay=0.0):
    """A robot with a sensor of its currents, whose constants are known badly."""
    source = replace(robot.motor_encoder.source, topic="/currents", field="effort", unit="A")
    sensor = MotorCurrent("current", source, np.full(robot.n, SIGMA), robot.joints, delay)
    own = [
        Parameter(name, 2.2, "N m/A", 2.2, 2.0)
        if "torque" in name
        else Parameter(name, 0.0, "A", 0.0, 1.0, positive=False)
        for name in TRUE
    ]
    parameters = {**robot.parameters, **{p.name: p for p in own}}
    return replace(robot, sensors={**robot.sensors, "current": sensor}, parameters=parameters)


@pytest.fixture(scope="module")
def robot():
    return with_currents(load_robot("doggy"))


def simulated(robot, delay=0.0, seconds=2.0, effects=(), **conditions):
    """A recording of currents that are so old [s]."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.tools.simulator import simulate

    there = robot.with_sensors({"current": replace(robot.motor_current, delay=delay)})
    known = {name: value for name, value in TRUE.items() if name in robot.parameters}
    made = simulate(
        there, "calibration", seconds, seed=3, friction="smooth", parameters=known, effects=effects, **conditions
    )
    return made


@pytest.fixture(scope="module")
def made(robot):
    return simulated(robot)


@pytest.fixture(scope="module")
def result(robot, made):
    return calibrate(robot, [made.recording])


def is_true(result, made, more=()):
    truth = {**made.truth["parameters"], **TRUE, **dict(more)}
    for name, p in result.robot.parameters.items():
        if not p.fixed:
            assert abs(p.value - truth[name]) < 4.0 * p.sigma, (name, p.value, truth[name], p.sigma)


def test_constants_offset_and_all_other_values_are_true(result, made):
    is_true(result, made)
    for name, true in TRUE.items():
        p = result.robot.parameters[name]
        assert p.sigma < 1e-3 and abs(p.value - true) < 2e-3, (name, p.value)
    assert result.robot.motor_current.delay == 0.0 and result.robot.motor_current.delay_sigma < 5e-5


def test_residuals_have_the_size_of_the_noise_and_the_answer_is_good(result):
    for joint in result.robot.joints:
        assert result.channels[f"{joint}.motor_current"].chi2 == pytest.approx(1.0, abs=0.1)
    check = next(c for c in judge(result).checks if c.name == NAME)
    assert check.level == "good" and "joint1 45 %" in check.text, check.text  # 3.0 * 4.696 of 31.328


def test_the_robot_without_them_agrees(robot, made, result):
    plain = calibrate(robot.without([robot.motor_current]), [made.recording]).robot
    assert "current" not in plain.sensors and plain.parameters["current.torque_per_ampere_joint1"].fixed
    for name in ("motor.k_pwm", "motor.inertia", "joint2.stiffness"):
        found, alone = result.robot.parameters[name], plain.parameters[name]
        assert abs(found.value - alone.value) < 4.0 * np.hypot(found.sigma, alone.sigma)
    assert result.robot.parameters["motor.k_pwm"].sigma < plain.parameters["motor.k_pwm"].sigma


@pytest.mark.parametrize("delay", [0.0032, -0.0004])
def test_a_delay_is_found_between_and_within_the_commands(robot, delay):
    late = simulated(robot, delay, seconds=3.0)
    found = calibrate(robot, [late.recording])
    sensor = found.robot.motor_current
    assert abs(sensor.delay - delay) < 3.0 * sensor.delay_sigma and sensor.delay_sigma < 3e-5
    is_true(found, late)
    assert any("with a delay of" in text for text in found.findings)
    kept = robot.with_sensors({"current": replace(robot.motor_current, estimate_delay=False)})
    assert with_current_delay(kept, [late.recording]) == (kept, [])


def test_irregular_stamps_tell_a_delay_by_themselves(robot):
    found = current_gap(robot, [simulated(robot, 0.002, jitter=2e-4).recording])
    assert found.first < 0.002 < found.last + 1e-5 and found.last - found.first < 5e-5


def test_a_command_that_is_late_is_told_from_a_late_sensor(robot):
    late = simulated(robot, effects=["command_delay@robot:delay=0.004"], seconds=3.0)
    known, said = with_current_delay(robot, [late.recording])
    assert known.motor_current.delay == 0.0
    assert "commands act about" in said[0].text and "command_delay@robot" in said[0].text
    found = calibrate(add_effect(robot, "command_delay@robot"), [late.recording])
    is_true(found, late, {"robot.command_delay.delay": 0.004}.items())
    assert abs(found.robot.motor_current.delay) < 3e-5


def test_the_estimator_takes_them_and_stays_consistent(result, made):
    found = replay(result.robot, made.recording)
    assert 0.8 < found.nis_mean < 1.25
    late = result.robot.with_sensors({"current": replace(result.robot.motor_current, delay=0.003)})
    assert replay(late, made.recording).nis_mean > 2.0  # the delay counts


def test_predictions_of_currents_have_errors_near_their_floors(result, made):
    comparison = compare_model("calibrated", result.robot, made.recording)
    for joint in result.robot.joints:
        channel = f"{joint}.motor_current"
        assert comparison.channels[channel].horizons["0.01"] < 3.0 * comparison.floors[channel] * SIGMA


def test_a_diagnosis_goes_without_them(robot, made):
    assert BaseModel.of(robot, [made.recording]).robot.motor_current is None


@pytest.mark.parametrize("runs_on", [False, True])
def test_derivatives_are_those_of_the_residual_with_effects_on_the_command(robot, runs_on):
    rng = np.random.default_rng(2)
    full = add_effect(robot, f"{COMMAND_DELAY.id}@robot", {"delay": 0.0013})
    back_emf = Parameter("current.back_emf_joint3", 4.0, "A s/rad", 4.0, 2.0)
    full = replace(full, parameters={**full.parameters, back_emf.name: back_emf})
    calibration, m = Calibration.of(full), 6
    ticks = np.append(0.0, np.cumsum(rng.uniform(8e-4, 1.2e-3, 12)))
    path = CommandPath(ticks, rng.uniform(-1.0, 1.0, (12, 3)), full.effects, full.joints, runs_on)
    step = np.arange(3, 3 + m)
    inner = factor_on_state(full, "current", rng.normal(size=(m, 3)), np.zeros(m))
    h = np.diff(ticks)[step]
    factor = DrivenFactor(inner, rng.uniform(size=m), h, full.layout, None, full.values, path=path, step=step)
    x = [rng.normal(size=(m, full.layout.size)) for _ in range(2)]
    linear = factor.linearize(tuple(x), calibration)
    for end in range(2):
        for i in range(full.layout.size):
            moved = [[each.copy() for each in x] for _ in range(2)]
            moved[0][end][:, i] += 1e-5
            moved[1][end][:, i] -= 1e-5
            slope = np.subtract(*(factor.residual(tuple(each), calibration) for each in moved)) / 2e-5
            np.testing.assert_allclose(linear.by_state[end][:, :, i], slope, atol=1e-5)
    for i, name in enumerate(calibration.names):
        step_of = np.zeros(len(calibration.names))
        step_of[i] = 1e-7
        ends = (factor.residual(tuple(x), calibration.retract({"dynamics": s * step_of})) for s in (1.0, -1.0))
        slope = np.subtract(*ends) / 2e-7
        np.testing.assert_allclose(linear.by_block["dynamics"][:, :, i], slope, rtol=1e-5, atol=2e-5, err_msg=name)
    part = factor.select(np.array([1, 4]))
    np.testing.assert_array_equal(
        part.residual((x[0][[1, 4]], x[1][[1, 4]]), calibration), factor.residual(tuple(x), calibration)[[1, 4]]
    )


def test_the_reading_at_one_state_is_that_of_the_factor(robot):
    rng = np.random.default_rng(4)
    x = rng.normal(size=(3, robot.layout.size + robot.n))
    linear = factor_on_state(robot, "current", np.zeros((3, 3)), np.zeros(3)).linearize((x,), Calibration.of(robot))
    readings = ReadingsAtOneState(robot)
    assert readings.feels_command("current") and not readings.feels_command(robot.motor_encoder.name)
    for k in range(3):
        reading, J = readings.read("current", x[k], 0.0)
        np.testing.assert_allclose(reading, linear.residual[k], rtol=1e-12)
        np.testing.assert_allclose(J, linear.by_state[0][k, :, : robot.layout.size], rtol=1e-12)


def changed(recording, values):
    stream = recording.streams["current"]
    return replace(recording, streams={**recording.streams, "current": replace(stream, values=values)})


def test_exchanged_currents_a_wrong_sign_and_another_unit_are_named(robot, made):
    recording, i = made.recording, made.recording.streams["current"].values
    assert mistaken_currents(recording, robot) == []
    (said,) = mistaken_currents(changed(recording, i[:, [1, 0, 2]]), robot)
    assert "currents of joint1 and joint2 seem to be exchanged" in said.text
    assert "names: [joint2, joint1, joint3]" in said.text
    (said,) = mistaken_currents(changed(recording, i * [1.0, -1.0, 1.0]), robot)
    assert "joint2 counts the other way" in said.text and "scale: [1, -1, 1]" in said.text
    (said,) = mistaken_currents(changed(recording, 1e3 * i), robot)
    assert "a thousand times what its command makes" in said.text and "scale: [0.001, 0.001, 0.001]" in said.text


def test_more_back_emf_than_damping_is_doubted(result):
    p = replace(result.robot.parameters["motor.k_mi"], value=5.0)
    wrong = replace(result, robot=replace(result.robot, parameters={**result.robot.parameters, p.name: p}))
    check = next(c for c in judge(wrong).checks if c.name == NAME)
    assert check.level == "warn" and "joint1 (14.1 of back-EMF, 5.00 N m s/rad of damping)" in check.text


def test_a_drive_that_takes_amperes_has_no_back_emf_and_its_delay_stays_in_the_middle_of_a_gap(tmp_path):
    text = load_robot("doggy").path.read_text().replace("unit: duty", "unit: A")
    text = re.sub(r"  motor\.k_pwm:.*", "  motor.torque_constant: {value: 30.0, unit: N m/A, prior_sigma: 50.0}", text)
    text = re.sub(r"  motor\.k_mi:.*", "", text).replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    plain = SENSOR.replace("mA", "A").replace("    delay: {value: 0.003}\n", "").replace("[0.02, 0.03, 0.04]", "0.002")
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace("\nsensors:", "\nsensors:" + plain.rstrip(), 1))
    robot = load_robot(path)  # without a constant of its own: the ampere that is measured is that of the command
    late = simulated(robot, 0.0024, seconds=3.0)
    found = calibrate(robot, [late.recording])
    is_true(found, late)
    assert found.robot.motor_current.delay == pytest.approx(0.0025, abs=1e-5)
    assert found.robot.motor_current.delay_sigma == pytest.approx(1e-3 / np.sqrt(12.0), rel=0.01)
    assert found.channels["joint1.motor_current"].chi2 == pytest.approx(1.0, abs=0.1)
    assert not any(check.name == NAME for check in judge(found).checks)


def test_an_offset_that_the_file_lacks_is_named(robot, made):
    plain = replace(robot, parameters={n: p for n, p in robot.parameters.items() if n != "current.offset_joint2"})
    found = calibrate(plain, [made.recording])
    (told,) = found.torque_readings
    assert told.parameter == "current.offset_joint2" and told.unit == "A"
    assert abs(told.value - 0.1) < 4.0 * told.sigma + 2e-3
    assert "`current.offset_joint2: {value: 0.0, unit: A, positive: false, prior_sigma: 3}`" in judge(found).answer


def test_a_supply_that_is_not_what_the_file_says_is_told_by_the_back_emf(robot, made):
    wrong = replace(robot, constants={**robot.constants, "motor.supply_voltage": 24.0})
    own = Parameter("current.back_emf_joint1", 4.0, "A s/rad", 4.0, 4.0)
    others = [replace(own, name=own.name.replace("1", k)) for k in "23"]
    wrong = replace(wrong, parameters={**wrong.parameters, **{p.name: p for p in (own, *others)}})
    check = next(c for c in judge(calibrate(wrong, [made.recording])).checks if c.name == NAME)
    volts = robot.constants["motor.supply_voltage"] / 24.0
    assert check.level == "warn" and f"One volt of the command is {volts:.2f}" in check.text, check.text
    assert "motor.supply_voltage is off by that" in check.text


def written(tmp_path, sensor=SENSOR, parameters=None, robot="doggy"):
    own = load_robot(robot)
    text = own.path.read_text().replace("\nsensors:", "\nsensors:" + sensor.rstrip(), 1)
    lines = [
        f"  current.torque_per_ampere_{joint}: {{value: 2.0, unit: N m/A, prior_sigma: 1.0}}" for joint in own.joints
    ]
    added = "\n".join(lines if parameters is None else parameters)
    path = tmp_path / "robot.yaml"
    path.write_text(
        text.replace("\nparameters:", f"\nparameters:\n{added}", 1).replace("urdf: ", f"urdf: {own.path.parent}/", 1)
    )
    return path


def test_a_file_with_currents_is_read_and_written(tmp_path, result):
    read = load_robot(written(tmp_path)).motor_current
    assert read.delay == 0.003 and read.estimate_delay and np.all(read.source.factor == 1e-3)
    np.testing.assert_array_equal(read.sigmas, [0.02, 0.03, 0.04])
    own = load_robot(written(tmp_path))
    found = own.with_sensors({"current": replace(read, delay=0.0031, delay_sigma=1e-5)})
    (tmp_path / "found.yaml").write_text(robot_text(found, tmp_path))
    again = load_robot(tmp_path / "found.yaml").motor_current
    assert (again.delay, again.delay_sigma) == (0.0031, 1e-5)


@pytest.mark.parametrize(
    ("sensor", "parameters", "said"),
    [
        (SENSOR.replace("mA", "N m"), None, "a current is in A or mA, got 'N m'"),
        (SENSOR.replace("0.003", "3.0"), None, "expected seconds, at most 0.1, got 3"),
        (SENSOR.replace("{value: 0.003}", "3.2 ms"), None, r"delay: expected a value in seconds, .* got '3.2 ms'"),
        (SENSOR.replace("0.02,", "-0.02,"), None, "expected numbers above zero"),
        (SENSOR + "    scale: [1, 0, 1]\n", None, r"scale: expected numbers other than zero, got \[1.0, 0.0, 1.0\]"),
        (SENSOR + "    wraps: 6.28\n", None, "wraps: a current does not begin anew like a counter"),
        (SENSOR, [], "'current.torque_per_ampere_joint1' is missing, the torque of one ampere behind the gear"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(tmp_path, sensor, parameters, said):
    with pytest.raises(RobotError, match=said):
        load_robot(written(tmp_path, sensor, parameters))


@pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data/biorob")
@pytest.mark.slow
def test_a_biorob_made_elsewhere_shows_its_constants_and_the_friction_of_its_bearings(tmp_path):
    text = SENSOR.replace("mA", "A").replace("/currents", "/motor_states").replace("[0.02, 0.03, 0.04]", "0.02")
    text = text.replace("    delay: {value: 0.003}", "    names: [motor1, motor2, motor3, motor4]")
    robot = load_robot(written(tmp_path, text, robot="biorob"))
    known = {f"current.torque_per_ampere_{joint}": 0.5 for joint in robot.joints}
    found = calibrate(robot.with_values(known), [read_recording(DATA / "train", robot)]).robot
    true = json.loads((DATA / "truth.json").read_text())["train"]["true"]
    for j, joint in enumerate(found.joints):
        k = found.parameters[f"current.torque_per_ampere_{joint}"]
        gain, damping = (found.parameters[f"{joint}.{name}"] for name in ("k_pwm", "k_mi"))
        back_emf = true["back_emf_damping_pulley_Nms_per_rad"][j]
        assert abs(k.value * gain.value - back_emf) < max(4.0 * k.sigma * gain.value, 5e-4 * back_emf)
        viscous = true["motor_viscous_pulley_Nms_per_rad"][j]
        assert damping.value - k.value * gain.value == pytest.approx(viscous, rel=0.02)
    assert abs(found.motor_current.delay) < 1e-4
