# SPDX-License-Identifier: BSD-3-Clause
"""Position-controlled servos are judged by their loop; servos integrated here by their textbook equation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jointscope.graphs.comparison.compare import compare_model
from jointscope.graphs.comparison.free_run import free_run
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.controller_gain import controller_of
from jointscope.robots.recordings.recording import Recording, Stream

GAIN, LOAD_FRICTION = 0.6, 0.25
WEIGHT = 0.49 * 9.81 * 0.1  # [N m] of the pendulum at right angles


@pytest.fixture(scope="module")
def servo():
    return load_robot("xl330_pendulum")


def measured(servo, seed, load_friction=0.0, seconds=6.0):
    """A recording of the servo with friction that grows with the weight it carries; every goal, reading and PWM."""
    p = {name: parameter.value for name, parameter in servo.parameters.items()}
    rng, supply = np.random.default_rng(seed), servo.constants["motor.supply_voltage"]
    goals = np.arange(0.0, seconds, 0.02)
    slow, fast = rng.uniform(0.6, 1.0), rng.uniform(2.0, 3.0)
    goal = 1.2 * np.sin(2 * np.pi * slow * goals / 2) + 0.5 * np.sign(np.sin(2 * np.pi * fast * goals / 2))

    def pwm(t, q):
        return np.clip(GAIN * (goal[min(int(t / 0.02 + 1e-9), len(goal) - 1)] - q), -1.0, 1.0)

    def rate(t, x):
        q, v = x
        friction = p["servo.coulomb_torque"] + load_friction * abs(WEIGHT * np.sin(q))
        torque = p["motor.k_pwm"] * supply * pwm(t, q) - p["motor.k_mi"] * v
        torque -= friction * np.tanh(servo.choices.friction_sharpness * v) + WEIGHT * np.sin(q)
        return [v, torque / (0.49 * 0.1**2 + p["motor.inertia"])]

    times = np.arange(0.0, seconds, 0.005)
    q = solve_ivp(rate, (0.0, seconds), [0.0, 0.0], t_eval=times, max_step=2e-3, rtol=1e-7, atol=1e-9).y[0]
    u = np.array([pwm(t, angle) for t, angle in zip(times, q, strict=True)])
    read = q + rng.normal(scale=servo.motor_encoder.sigmas[0], size=len(q))
    streams = {
        "command": Stream("command", times, u[:, None], ("servo.command",), "1"),
        "motor_encoder": Stream("motor_encoder", times, read[:, None], ("servo.motor_position",), "rad"),
    }
    moving = Stream("goal", goals, goal[:, None], ("servo.goal",), "rad")
    return Recording(f"servo {seed}", f"{seed}", 10**18, streams, goal=moving)


@pytest.fixture(scope="module")
def loaded(servo):
    return [measured(servo, seed, LOAD_FRICTION) for seed in (1, 2)]


def test_a_recording_tells_the_gain_of_its_controller(servo, loaded):
    assert servo.controller.gain is None
    assert controller_of(servo, loaded[0]).gain[0] == pytest.approx(GAIN, rel=0.02)
    run = free_run(servo, measured(servo, 3))
    assert np.ptp(run.measured) > 1.0
    assert run.mean_abs["servo.motor_position"] < 5e-3


def test_a_gain_that_cannot_be_measured_is_named(servo, loaded):
    command = loaded[0].command
    backwards = Stream("command", command.times, -command.values, command.channels, command.unit)
    with pytest.raises(RecordingError, match=r"gain of servo's controller cannot be measured: .* set controller\.gain"):
        controller_of(servo, replace(loaded[0], streams=loaded[0].streams | {"command": backwards}))
    with pytest.raises(RecordingError, match="holds no goal positions on /motor_command"):
        controller_of(servo, replace(loaded[0], goal=None))


@pytest.mark.slow
def test_what_is_missing_is_judged_by_the_loop(servo, loaded):
    found = diagnose(servo, loaded, measured(servo, 4, LOAD_FRICTION), leaders=2, missing_torque=False)
    first = found.candidates[0]
    assert found.judged_by == "of the loop simulated from its goals"
    assert (first.label, first.verdict) == ("load_dependent_friction@servo", "missing")
    assert first.parameters["coefficient"].value == pytest.approx(LOAD_FRICTION, rel=0.1)
    assert first.heldout_error < 0.3 * found.error
    assert "error of the loop simulated from its goals" in " ".join(found.paragraphs)


@pytest.mark.slow
def test_without_goals_predictions_judge(servo, loaded):
    with_goals = compare_model("loop", servo, loaded[0])
    assert with_goals.judged_error == pytest.approx(
        with_goals.free_run.rms["servo.motor_position"] / servo.motor_encoder.sigmas[0]
    )
    alone = compare_model("ahead", servo, replace(loaded[0], goal=None))
    assert (alone.judged_by, alone.judged_error, alone.judged_floor) == ("0.1 s ahead", alone.error, alone.floor)
