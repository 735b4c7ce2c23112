# SPDX-License-Identifier: BSD-3-Clause
"""A position-controlled servo simulated with its controller, against an integration that shares no code with it."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jointscope.graphs.comparison.free_run import free_run
from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.bags.write_bag import write_bag

REAL = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "real"
OFF = 2.0  # [s] from when the drive is off


@pytest.fixture(scope="module")
def servo():
    robot = load_robot("xl330_pendulum")
    return replace(robot, controller=replace(robot.controller, gain=(0.28774,)))


def pendulum(servo, switched_off=False, seconds=3.0, push=0.0):
    """What the servo does, by its textbook equation; goals 50 times a second."""
    p = {name: parameter.value for name, parameter in servo.parameters.items()}
    gain, supply = servo.controller.gain[0], servo.constants["motor.supply_voltage"]
    goals = np.arange(0.0, seconds, 0.02)
    goal = 0.8 * np.sin(2.0 * goals)
    if switched_off:
        goal[goals >= OFF] = np.nan

    def rate(t, x):
        q, v = x
        wanted = goal[min(int(t / 0.02 + 1e-9), len(goal) - 1)]
        on = np.isfinite(wanted)
        volts = supply * np.clip(gain * (wanted - q), -1.0, 1.0) if on else 0.0
        torque = p["motor.k_pwm"] * volts - (p["motor.k_mi"] * v if on else 0.0)
        torque += push if 1.0 <= t < 1.2 else 0.0
        torque -= p["servo.coulomb_torque"] * np.tanh(servo.choices.friction_sharpness * v)
        return [v, (torque - 0.49 * 9.81 * 0.1 * np.sin(q)) / (0.49 * 0.1**2 + p["motor.inertia"])]

    times = np.arange(0.0, seconds, 0.005)
    q = solve_ivp(rate, (0.0, seconds), [0.0, 0.0], t_eval=times, max_step=1e-3, rtol=1e-8, atol=1e-10).y[0]
    channels = ("servo.motor_position",)
    streams = {
        "command": Stream("command", times, np.full((len(times), 1), 0.01), ("servo.command",), "1"),
        "motor_encoder": Stream("motor_encoder", times, q[:, None], channels, "rad"),
    }
    return Recording("", "", 10**18, streams, goal=Stream("goal", goals, goal[:, None], ("servo.goal",), "rad"))


def test_the_loop_is_that_of_the_textbook(servo):
    run = free_run(servo, pendulum(servo))
    assert np.ptp(run.measured) > 0.3
    assert run.mean_abs["servo.motor_position"] < 2e-3
    assert run.rms["servo.motor_position"] >= run.mean_abs["servo.motor_position"]


def test_a_loop_begins_anew_where_something_was_left_out(servo):
    pushed = pendulum(servo, push=1.5)
    assert free_run(servo, pushed).rms["servo.motor_position"] > 0.1
    without = free_run(servo, pushed.leaving_out([(1.0, 1.2)]))
    assert without.rms["servo.motor_position"] < 0.02
    assert not np.any((without.times > 1.0) & (without.times < 1.2)) and np.any(without.times > 2.5)


def test_a_drive_that_is_off_lets_the_pendulum_swing(servo):
    recording = pendulum(servo, switched_off=True)
    run = free_run(servo, recording)
    assert run.mean_abs["servo.motor_position"] < 3e-3
    swinging = run.times > OFF + 0.1
    assert np.min(run.measured[swinging]) < -0.02  # it passes the bottom, which the controller would not let it


def test_a_wrong_gain_is_seen(servo):
    soft = replace(servo, controller=replace(servo.controller, gain=(0.5 * servo.controller.gain[0],)))
    assert free_run(soft, pendulum(servo)).mean_abs["servo.motor_position"] > 0.05


def loose_magnet(servo, half, seconds=3.0):
    """The textbook servo whose controller reads a magnet that a pin pushes along, `half` either way; small steps."""
    p, h = {name: parameter.value for name, parameter in servo.parameters.items()}, 1e-5
    gain, supply = servo.controller.gain[0], servo.constants["motor.supply_voltage"]
    sharpness = servo.choices.friction_sharpness
    goals = np.arange(0.0, seconds, 0.02)
    goal, read = 0.8 * np.sin(2.0 * goals), []
    q = v = magnet = 0.0
    for k in range(round(seconds / h)):
        magnet = min(max(magnet, q - half), q + half)
        if k % 500 == 0:
            read.append(magnet)
        volts = supply * min(max(gain * (goal[k // 2000] - magnet), -1.0), 1.0)
        torque = p["motor.k_pwm"] * volts - p["motor.k_mi"] * v - p["servo.coulomb_torque"] * math.tanh(sharpness * v)
        v += h * (torque - 0.49 * 9.81 * 0.1 * math.sin(q)) / (0.49 * 0.1**2 + p["motor.inertia"])
        q += h * v
    like = pendulum(servo, seconds=seconds)
    encoder = replace(like.streams["motor_encoder"], values=np.array(read)[:, None])
    return replace(like, streams={**like.streams, "motor_encoder": encoder})


def test_a_controller_reads_its_encoder_with_the_play_that_it_has(servo):
    half = 0.03
    recording = loose_magnet(servo, half)
    own = add_effect(servo, "encoder_hysteresis@servo", {"half_play": half})
    assert free_run(own, recording).mean_abs["servo.motor_position"] < 2e-3
    assert free_run(servo, recording).mean_abs["servo.motor_position"] > 5e-3


def test_a_model_that_runs_away_is_infinitely_far_off(servo):
    driven = servo.with_values({"motor.k_mi": -10.0})  # damped the wrong way round
    with np.errstate(all="ignore"):
        assert free_run(driven, pendulum(servo, seconds=0.5)).rms["servo.motor_position"] == np.inf


def test_what_cannot_be_simulated_is_said(servo):
    recording = pendulum(servo)
    with pytest.raises(RecordingError, match="no goal positions on /motor_command"):
        free_run(servo, replace(recording, goal=None))
    with pytest.raises(RobotError, match="no section `controller`"):
        free_run(replace(servo, controller=None), recording)
    with pytest.raises(RobotError, match=r"effects on the command yet: pwm_deadband@servo"):
        free_run(add_effect(servo, "pwm_deadband@servo"), recording)


def test_a_bag_without_goals_can_be_read_and_says_so(servo, tmp_path):
    write_bag(tmp_path / "run.mcap", replace(pendulum(servo), goal=None), servo)
    recording = read_recording(tmp_path / "run.mcap", servo)
    assert recording.goal is None
    assert any("the controller cannot be simulated" in notice.text for notice in recording.notices)


@pytest.mark.skipif(not REAL.is_dir(), reason="shared/data/real is not beside the project")
def test_goals_are_read_with_the_stretches_where_the_drive_was_off(servo):
    recording = read_recording(REAL / "bam_xl330" / "kp100_lift_and_drop", servo)
    assert np.isnan(recording.goal.values).any() and np.isfinite(recording.goal.values).any()
    part = recording.between(0.0, 1.0)
    assert part.goal.times[-1] < 1.0
