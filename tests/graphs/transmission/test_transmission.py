# SPDX-License-Identifier: BSD-3-Clause
"""Robots whose masses are not known: what is hidden between motors, links and gyros is found, and nothing else."""

from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.transmission.calibrate_links import calibrate_links
from jointscope.graphs.transmission.discover_links import discover_links
from jointscope.graphs.transmission.equation import Equation
from jointscope.graphs.transmission.free_links import EquationRows
from jointscope.graphs.transmission.joint_signals import joint_signals
from jointscope.graphs.transmission.linear_equations import LinearEquations
from jointscope.graphs.transmission.what_may_be_added import fails_elsewhere
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.read_recording import read_recording

REAL = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "real"
COMPLIANCE = np.array([0.012, 0.008])  # [rad/(N m)]
TILT = 0.2  # [rad] of the gyro in its housing, about x
needs_real = pytest.mark.skipif(not REAL.is_dir(), reason="shared/data/real is not beside the project")


def arm(compliance=COMPLIANCE, link_late=0.0, gyro_late=0.0, lag=(0.0, 0.0), seconds=24.0, seed=1, hole=None):
    """A recording of two joints that follow smooth paths, with torques that do not follow from them.

    `lag` is a part of each joint's deflection that goes with its speed [s]; `hole` a pause in all sensors [s].
    """
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.004, 0.016, int(seconds / 0.01)))
    if hole is not None:
        times = times[(times < hole[0]) | (times > hole[1])]
    phases = rng.uniform(0.0, 6.0, (2, 3))
    speeds = np.array([[1.1, 2.7, 5.3], [0.9, 3.1, 6.1]])

    def q(t):
        return np.column_stack([0.3 * np.sin(np.outer(t, speeds[j]) + phases[j]).sum(axis=1) for j in (0, 1)])

    def v(t):
        return (q(t + 1e-4) - q(t - 1e-4)) / 2e-4

    torque = np.column_stack([3.0 * np.sin(1.7 * times + 1.0) + np.sin(4.4 * times), 2.0 * np.cos(2.3 * times)])
    motor = q(times) + compliance * torque + np.array(lag) * v(times) + [1.0, -7.0]
    noise = rng.standard_normal
    turn = np.array([[1, 0, 0], [0, np.cos(TILT), np.sin(TILT)], [0, -np.sin(TILT), np.cos(TILT)]])
    omega = np.column_stack([0 * times, 0 * times, v(times - gyro_late)[:, 0]]) @ turn.T + [0.01, 0.0, -0.02]
    values = {
        "command": (np.clip(torque, -1.0, 1.0), "1"),
        "motor_encoder": (0.002 * np.rint(motor / 0.002), "rad"),
        "link_encoder": (q(times - link_late) + 1e-4 * noise((len(times), 2)), "rad"),
        "joint_torque": (torque + 0.02 * noise((len(times), 2)), "N m"),
        "imu2": (omega + 0.02 * noise((len(times), 3)), "rad/s"),
    }
    streams = {
        name: Stream(name, times, data, tuple(f"{name}.{i}" for i in range(data.shape[1])), unit)
        for name, (data, unit) in values.items()
    }
    return Recording(f"arm{seed}", "", 10**18, streams)


@pytest.fixture(scope="module")
def robot():
    return load_robot("hebi_2r")


def added(result):
    return [step.added for step in result.steps[1:]]


def left(result, channel, step):
    return result.steps[step].comparison.channels[channel].horizons["0.1"]


def candidate(step, label):
    return next((c for c in step.diagnosis.candidates if c.label == label), None)


def test_hidden_springs_and_a_late_gyro_are_found_with_their_sizes_and_nothing_else(robot):
    result = discover_links(robot, [arm(gyro_late=0.011)], arm(gyro_late=0.011, seed=2))
    assert set(added(result)) == {"joint_elasticity@joint1", "joint_elasticity@joint2", "gyro_delay@imu2"}
    for j, joint in enumerate(("joint1", "joint2")):
        parameter = result.robot.parameters[f"{joint}.joint_elasticity.compliance"]
        assert parameter.value == pytest.approx(COMPLIANCE[j], rel=0.02)
        assert abs(parameter.value - COMPLIANCE[j]) < 5.0 * parameter.sigma
    assert result.robot.parameters["imu2.gyro_delay.delay"].value == pytest.approx(0.011, abs=5e-4)
    assert left(result, "joint1.gear", -1) < 0.1 * left(result, "joint1.gear", 0)
    assert result.steps[-1].heldout_error < 1.0 and result.adequate
    said = {step.added: step.paragraph for step in result.steps}
    assert "joint_elasticity@joint1 added (compliance 0.0119" in said["joint_elasticity@joint1"]
    assert "the training error falls from" in said["gyro_delay@imu2"]


def test_the_mounting_of_a_gyro_is_found_and_written(robot):
    result = calibrate_links(robot, [arm()])
    turned = result.robot.gyros[0].R_imu_body
    # rotation about the only axis that moves the gyro is open; the direction of that axis is not
    np.testing.assert_allclose(turned[:, 2], [0.0, np.sin(TILT), np.cos(TILT)], atol=0.01)


def test_rigid_joints_with_sensors_in_time_get_no_effect(robot):
    result = discover_links(robot, [arm(compliance=np.zeros(2))])
    assert added(result) == []


def test_one_lateness_of_all_link_encoders_is_called_time_and_names_friction_as_its_look_alike():
    robot = load_robot("kr300")
    recordings = [_arm_of_three(seed) for seed in (1, 2)]
    result = discover_links(robot, recordings)
    assert added(result)[0] == "encoder_delay@link_encoder"
    assert result.robot.parameters["link_encoder.encoder_delay.delay"].value == pytest.approx(3e-3, rel=0.05)
    found = result.steps[0].diagnosis.candidates[0]
    assert {f"motor_viscous@joint_a{k}" for k in (1, 2, 3)} <= set(found.look_alikes)
    assert "say that it is time" in found.reasons[0]


def test_lags_that_differ_a_little_from_joint_to_joint_leave_damping_possible(robot):
    result = discover_links(robot, [arm(lag=(4e-3, 2.5e-3))])
    late = [candidate(step, "encoder_delay@link_encoder") for step in result.steps]
    assert any(c.verdict == "missing" and "damping remains possible" in c.reasons[0] for c in late if c is not None)


def test_lags_that_differ_widely_are_no_lateness_of_one_sensor(robot):
    result = discover_links(robot, [arm(lag=(8e-3, 1e-3))])
    assert "encoder_delay@link_encoder" not in added(result)
    assert "helps in" in candidate(result.steps[-1], "encoder_delay@link_encoder").reasons[0]


def test_the_held_out_recording_chooses_nothing(robot):
    with_holdout = discover_links(robot, [arm()], arm(compliance=np.zeros(2), seed=3))
    without = discover_links(robot, [arm()])
    assert added(with_holdout) == added(without)
    assert np.isnan(without.steps[1].heldout_error)


def test_what_repeats_only_within_a_stretch_does_not_help_elsewhere():
    """A ripple that one quarter of a recording shows strongly, and the others the other way round."""
    times = np.arange(0.0, 40.0, 0.02)
    ripple = np.where(times < 10.0, 3.0, 1.0) * np.sin(5.0 * times)
    rng = np.random.default_rng(5)

    def helps(sign):
        error = np.where(times < 10.0, 1.0, sign) * ripple + rng.normal(0.0, 0.3, len(times))
        nothing = np.zeros((len(times), 1))
        columns = {"ripple": ripple[:, None]}
        equation = Equation(("joint1.gear",), "rad", 1.0, times, error[:, None], nothing, columns, times)
        rows = EquationRows(equation, nothing, np.zeros((len(times), 1, 0)))
        return fails_elsewhere(LinearEquations.of([rows], ["ripple"]), [], ["ripple"], {"joint1.gear"}) == ""

    assert helps(1.0)
    assert not helps(-1.0)


def test_samples_beside_a_gap_are_left_out(robot):
    signals = joint_signals(arm(hole=(10.0, 11.0)), robot)
    assert not np.any((signals.times > 9.99) & (signals.times < 11.01))


def test_streams_of_different_times_are_refused_in_one_line(robot):
    recording = arm()
    late = recording.streams["link_encoder"]
    moved = Stream(late.name, late.times + 1e3, late.values, late.channels, late.unit)
    with pytest.raises(RecordingError, match="stamped by the same clock"):
        joint_signals(Recording("x", "", 0, {**recording.streams, "link_encoder": moved}), robot)


@needs_real
def test_the_offset_between_the_encoders_of_a_kr300_is_found_as_time():
    robot = load_robot("kr300")
    a, b, c = (read_recording(REAL / "kr300" / f"traj_{k}", robot) for k in "ABC")
    result = discover_links(robot, [a, b], c)
    assert added(result)[0] == "encoder_delay@link_encoder"
    assert result.robot.parameters["link_encoder.encoder_delay.delay"].value == pytest.approx(3.0e-3, abs=2e-4)
    gears = [f"{joint}.gear" for joint in robot.joints]
    assert all(left(result, gear, -1) < 0.2 * left(result, gear, 0) for gear in gears)


@needs_real
def test_the_spring_of_a_hebi_module_is_found_as_its_maker_calibrated_it():
    robot = load_robot("hebi_2r")
    whole = read_recording(REAL / "hebi_arms_mit" / "arm2_ps2_virtual_spring", robot)
    result = discover_links(robot, [whole.between(-1.0, 28.5)], whole.between(28.5, 60.0))
    assert added(result)[0] == "joint_elasticity@joint1"
    stiffness = 1.0 / result.robot.parameters["joint1.joint_elasticity.compliance"].value
    assert stiffness == pytest.approx(70.0, rel=0.05)


def test_a_ripple_of_unknown_order_is_found_and_written_with_it():
    robot = load_robot("kr300")
    recordings = [_arm_of_three(seed, ripple=(6e-5, 310.0)) for seed in (1, 2)]
    result = discover_links(robot, recordings, _arm_of_three(3, ripple=(6e-5, 310.0)))
    assert "encoder_eccentricity@joint_a2" in added(result)
    prefix = "joint_a2.encoder_eccentricity."
    found = {name: result.robot.parameters[prefix + name].value for name in ("cos", "sin", "order")}
    assert found["order"] == pytest.approx(310.0, abs=2.0)
    assert np.hypot(found["cos"], found["sin"]) == pytest.approx(6e-5, rel=0.1)
    k = added(result).index("encoder_eccentricity@joint_a2")
    assert "periods per turn" in candidate(result.steps[k], "encoder_eccentricity@joint_a2").reasons[0]
    assert left(result, "joint_a2.gear", -1) < 0.5 * left(result, "joint_a2.gear", 1)


def test_where_nothing_repeats_fast_with_the_position_no_order_is_claimed():
    result = discover_links(load_robot("kr300"), [_arm_of_three(seed) for seed in (1, 2)])
    orders = [p.value for name, p in result.robot.parameters.items() if name.endswith(".order")]
    assert set(orders) <= {1.0}


def _arm_of_three(seed, ripple=(0.0, 1.0)):
    """Torque in a motor of a KR300: friction and a load, a spring of 5e6 N m/rad, link encoders 3 ms late.

    `ripple` of joint 2: amplitude [rad] and periods per turn.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 10.0, 0.004)
    w, p = rng.uniform(1.0, 5.0, (3, 4)), rng.uniform(0.0, 6.0, (3, 4))

    def q(t):
        return np.column_stack([(0.1 * np.sin(np.outer(t, w[j]) + p[j])).sum(axis=1) for j in range(3)])

    v = (q(times + 1e-4) - q(times - 1e-4)) / 2e-4
    load = 1500.0 * np.cos(q(times) * 3.0 + np.arange(3))
    torque = load + 300.0 * np.tanh(100.0 * v)
    wave = ripple[0] * np.sin(ripple[1] * q(times)[:, 1] + 0.7)
    data = {
        "command": torque + 5.0 * rng.standard_normal(v.shape),
        "motor_encoder": q(times) + 2e-7 * load + np.outer(wave, [0.0, 1.0, 0.0]) + 1e-5 * rng.standard_normal(v.shape),
        "link_encoder": q(times - 3e-3) + 1e-5 * rng.standard_normal(v.shape),
    }
    streams = {
        name: Stream(name, times, values, tuple(f"{name}.{i}" for i in range(3)), "rad")
        for name, values in data.items()
    }
    return Recording(f"kr{seed}", "", 10**18, streams)
