# SPDX-License-Identifier: BSD-3-Clause
"""Simulated effects of sensors and clocks, and mistakes, against the true states."""

import numpy as np
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator import simulate
from jointscope.tools.simulator.effects import make_effect
from jointscope.tools.simulator.loop.controller import GAIN
from jointscope.tools.simulator.world.engine import TICK
from jointscope.tools.simulator.world.trajectory import Trajectory

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

DOGGY = load_robot("doggy")


def lag(late: np.ndarray, early: np.ndarray) -> float:
    """Time by which one signal of 1 kHz trails another, from the top of their cross-correlation [s]."""
    shifts = np.arange(-20, 21)
    inner = slice(20, -20)
    score = [np.sum((np.roll(early, k)[inner] - late[inner]) ** 2) for k in shifts]
    top = int(np.argmin(score))
    left, mid, right = score[top - 1 : top + 2]
    return (shifts[top] + 0.5 * (left - right) / (left - 2 * mid + right)) * TICK


def recorded(*effects: str):
    return simulate(DOGGY, "moves", 2.5, 5, effects=effects, quantized=False)


@pytest.mark.parametrize(
    ("text", "lags"),  # of the streams motor_encoder, imu1, imu2 against the true states [ms]
    [
        ("encoder_delay@robot:delay=0.0025", (2.5, 0, 0)),
        ("gyro_delay@imu2:delay=0.0043", (0, 0, 4.3)),
        ("clock_offset@imu1:offset=-0.003", (0, -3, 0)),
        ("clock_offset@robot:offset=0.0015", (1.5, 1.5, 1.5)),
        ("clock_offset@robot:offset=-0.002", (-2, -2, -2)),
    ],
)
def test_late_stamps_and_old_readings_show_in_the_cross_correlation(text, lags):
    simulation = recorded(text)
    q, v = simulation.states[:, :3], simulation.states[:, 3:6]
    signals = {"motor_encoder": simulation.states[:, 7]}
    for gyro in DOGGY.gyros:
        omega, _, _ = DOGGY.tree.body_rate(gyro.body, q, v)
        mounted = simulation.truth["parameters"][f"{gyro.name}.R_imu_body"]
        signals[gyro.name] = (omega @ np.array(mounted).T)[:, 1]
    for (name, true), expected in zip(signals.items(), lags, strict=True):
        stream = simulation.recording.streams[name]
        values = stream.values[:, 1] - simulation.truth["parameters"].get(f"{name}.bias", [0, 0, 0])[1]
        assert lag(values, true[: len(values)]) == pytest.approx(1e-3 * expected, abs=1e-4)


def test_a_clock_that_runs_backwards_in_offset_records_nothing_from_after_the_end():
    streams = recorded("clock_offset@imu1:offset=-0.0035").recording.streams
    assert len(streams["imu1"]) == len(streams["imu2"]) - 3
    assert len(streams["motor_encoder"]) == 2500


def test_a_drifting_clock_is_late_in_proportion_to_time():
    simulation = recorded("clock_drift@imu2:drift=0.002")
    stamps = simulation.recording.streams["imu2"].times
    trajectory = Trajectory(TICK, simulation.states[:, :3], simulation.states[:, 3:6])
    q, v = trajectory.at(stamps / 1.002)
    omega, _, _ = DOGGY.tree.body_rate("link3", q, v)
    R, bias = (np.array(simulation.truth["parameters"][f"imu2.{x}"]) for x in ("R_imu_body", "bias"))
    error = simulation.recording.streams["imu2"].values - omega @ R.T - bias
    assert error.std() == pytest.approx(DOGGY.gyros[1].sigma, rel=0.05)


def test_the_controller_gets_the_old_angles_of_late_encoders_but_knows_nothing_of_clocks():
    for text, held in (("encoder_delay@joint2:delay=0.004", True), ("clock_offset@robot:offset=0.004", False)):
        simulation = recorded(text)
        u, t = simulation.recording.command.values[:, 1], simulation.state_times
        target = u / GAIN + simulation.recording.streams["motor_encoder"].values[:, 1]
        free = (np.abs(u[:-1]) < 0.13) & (np.abs(u[1:]) < 0.13) & (t[1:] > 0.6)
        constant = np.abs(np.diff(target))[free] < 1e-9
        assert free.sum() > 100 and (constant.mean() > 0.95) == held
    late = recorded("encoder_delay@joint2:delay=0.004")
    others = late.recording.streams["motor_encoder"].values[:, [0, 2]] - late.states[:, [6, 8]]
    assert others.std() == pytest.approx(DOGGY.motor_encoder.sigmas[0], rel=0.05)


def encoder_change(text: str) -> tuple[np.ndarray, np.ndarray]:
    """What joint 1's encoder shows beyond the true angle, noise included, and the true angle."""
    simulation = recorded(text)
    return simulation.recording.streams["motor_encoder"].values[:, 0] - simulation.states[:, 6], simulation.states[:, 6]


def test_an_eccentric_disc_shows_the_catalogue_law_to_first_order_and_more():
    error, q = encoder_change("encoder_eccentricity@joint1:cos=2e-3,sin=-1e-3,order=10")
    first = 2e-3 * np.cos(10 * q) - 1e-3 * np.sin(10 * q)
    e = 10 * np.hypot(2e-3, 1e-3)
    rest = (error - first).std()
    assert rest < 1.2 * np.hypot(e**2 / 20 / np.sqrt(2), DOGGY.motor_encoder.sigmas[0])
    assert np.corrcoef(error, first)[0, 1] > 0.99


def test_a_hall_sensor_on_the_link_shows_two_harmonics_to_first_order_and_nothing_on_other_joints():
    arm = load_robot("biorob")
    effect = make_effect("encoder_eccentricity@joint3.link:cos=0.02,sin=-0.01,cos2=0.015,sin2=0.005", arm)
    q = np.linspace(-3.0, 3.0, 601)[:, None] * np.ones(4)
    error = effect.reading(arm.link_encoder, q[:, 0], q) - q
    first = 0.02 * np.cos(q) - 0.01 * np.sin(q) + 0.015 * np.cos(2 * q) + 0.005 * np.sin(2 * q)
    np.testing.assert_array_equal(error[:, [0, 1, 3]], 0.0)
    assert 1e-4 < np.abs(error - first)[:, 2].max() < 2e-3
    np.testing.assert_array_equal(effect.reading(arm.motor_encoder, q[:, 0], q), q)


def test_mistakes_change_the_bag_and_nothing_else():
    plain, wrong = recorded(), recorded("wrong_gear@joint1:factor=-2", "swapped_axes@imu2:swap=13")
    np.testing.assert_array_equal(plain.states, wrong.states)
    streams, changed = plain.recording.streams, wrong.recording.streams
    encoder = streams["motor_encoder"].values * [-2.0, 1.0, 1.0]
    np.testing.assert_array_equal(changed["motor_encoder"].values, encoder)
    np.testing.assert_array_equal(changed["imu2"].values, streams["imu2"].values[:, [2, 1, 0]])
    np.testing.assert_array_equal(changed["imu1"].values, streams["imu1"].values)


def test_a_gyro_shows_its_scale_and_the_drift_of_its_bias():
    plain, wrong = recorded(), recorded("gyro_scale@imu2:x=0.1,y=-0.2,z=0", "gyro_bias_drift@imu2:x=0.1,y=0,z=-0.3")
    bias = np.array(plain.truth["parameters"]["imu2.bias"])
    stream = plain.recording.streams["imu2"]
    change = wrong.recording.streams["imu2"].values - stream.values
    expected = (stream.values - bias) * [0.1, -0.2, 0.0] + np.outer(stream.times, [0.1, 0.0, -0.3])
    assert np.abs(change - expected).max() < 5 * 0.2 * DOGGY.gyros[1].sigma  # the noise is not scaled
    np.testing.assert_array_equal(wrong.recording.streams["imu1"].values, plain.recording.streams["imu1"].values)


@pytest.mark.parametrize(("robot", "owner"), [("doggy", "joint2"), ("biorob", "joint3.link")])
def test_play_of_an_encoder_holds_its_reading_until_its_end_pushes(robot, owner):
    arm, half = load_robot(robot), 4e-3
    simulation = simulate(
        arm, "moves", 2.5, 5, effects=[f"encoder_hysteresis@{owner}:half_play={half}"], quantized=False
    )
    on_link, joint = owner.endswith(".link"), arm.joints.index(owner.removesuffix(".link"))
    stream = simulation.recording.streams["link_encoder" if on_link else "motor_encoder"]
    q = simulation.states[:, joint if on_link else 2 * arm.n + joint]
    behind = np.interp(stream.times, simulation.state_times, q) - stream.values[:, joint]
    slow, magnet = np.empty(len(q)), q[0]
    for k, shaft in enumerate(q):
        magnet = min(max(magnet, shaft - half), shaft + half)
        slow[k] = shaft - magnet
    expected = np.interp(stream.times, simulation.state_times, slow)
    sigma = (arm.link_encoder if on_link else arm.motor_encoder).sigmas[joint]
    assert np.std(behind - expected) < 1.3 * sigma
    assert np.ptp(expected) > 1.9 * half
