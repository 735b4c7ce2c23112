# SPDX-License-Identifier: BSD-3-Clause
"""Names of weak directions, widened sigmas, estimated noise, prediction."""

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.identifiability import weak_directions
from jointscope.graphs.comparison.prediction import Predictor
from jointscope.graphs.noise.robust_sigma import BlockScores, inflation
from jointscope.graphs.problem.timeline import Timeline
from jointscope.graphs.solving.shared_layout import SharedLayout
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.recordings.recording import Recording, Stream


def test_a_common_scale_is_named_with_its_members_and_size(doggy):
    calibration = Calibration.of(doggy)
    shared = SharedLayout.of(calibration, 1)
    covariance = 1e-8 * np.eye(shared.size)
    together = np.zeros(shared.size)
    together[:3] = 0.18
    covariance += np.outer(together, together)
    (found,) = weak_directions(doggy, calibration, shared, covariance)
    assert set(found.weights) == {"motor.k_pwm", "motor.k_mi", "motor.inertia"}
    assert found.sigma == pytest.approx(0.18, rel=1e-3)
    assert found.text.endswith("scale together, +-18 %")


def test_opposite_changes_trade_off(doggy):
    calibration = Calibration.of(doggy)
    shared = SharedLayout.of(calibration, 1)
    direction = np.zeros(shared.size)
    direction[[6, 9]] = 0.1, -0.1
    (found,) = weak_directions(doggy, calibration, shared, np.outer(direction, direction))
    assert "joint1.stiffness and joint1.damping trade off against each other, +-10 %" in found.text


def test_a_large_value_of_any_sign_is_as_weak_as_its_relative_sigma(doggy):
    robot = add_effect(doggy, "motor_viscous@joint1")
    name = "joint1.motor_viscous.coefficient"
    robot = robot.with_values({name: 300.0})
    calibration = Calibration.of(robot)
    shared = SharedLayout.of(calibration, 1)
    k = calibration.names.index(name)
    for sigma, weak in ((0.06, []), (9.0, [f"{name} is weakly determined, +-3 %"])):
        covariance = np.zeros((shared.size, shared.size))
        covariance[k, k] = sigma**2
        assert [d.text for d in weak_directions(robot, calibration, shared, covariance)] == weak


@pytest.mark.parametrize("memory", [0.0, 0.99])
def test_jackknife_over_blocks_finds_the_spread_of_estimates_under_coloured_noise(memory):
    """Straight-line fits to AR(1) noise: reported sigmas against the scatter over many repetitions."""
    rng = np.random.default_rng(0)
    t = np.arange(20000) * 1e-3
    design = np.column_stack([np.sin(t), np.cos(0.7 * t)])
    H = design.T @ design
    estimates, reported = [], []
    for _ in range(60):
        noise = rng.normal(size=len(t))
        for k in range(1, len(t)) if memory else ():
            noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * noise[k]
        estimate = np.linalg.solve(H, design.T @ noise)
        scores = BlockScores(0.0, 20.0, np.arange(2), 2)
        scores.add(t, (noise - design @ estimate)[:, None], design[:, None, :])
        estimates.append(estimate)
        reported.append(inflation([scores], np.linalg.inv(H)) * np.sqrt(np.diag(np.linalg.inv(H))))
    scatter, typical = np.std(estimates, axis=0), np.sqrt(np.mean(np.square(reported), axis=0))
    # 60 repetitions know the scatter to 9 %; a memory of 0.1 s reaches across the edges of half-second blocks
    assert np.all(typical > 0.7 * scatter) and np.all(typical < 1.4 * scatter)


@pytest.mark.slow
def test_process_noise_of_disturbed_recordings_is_found(doggy):
    pytest.importorskip("mujoco")
    from jointscope.tools.simulator import Disturbance, simulate

    quiet, loud = (
        calibrate(
            doggy,
            [
                simulate(
                    doggy,
                    "calibration",
                    6.0,
                    seed=3,
                    friction="smooth",
                    quantized=False,
                    disturbance=Disturbance(link=0.0, motor=rms, correlation_time=0.0),
                ).recording
            ],
        ).noise.motor_velocity
        for rms in (1.0, 4.0)
    )
    # white torque of rms tau held for 1 ms on an inertia b: density tau sqrt(1 ms) / b
    inertia = 2.428
    np.testing.assert_allclose(quiet, 1.0 * np.sqrt(1e-3) / inertia, rtol=0.25)
    np.testing.assert_allclose(loud, 4.0 * np.sqrt(1e-3) / inertia, rtol=0.25)


def test_prediction_follows_the_simulator(simulated, doggy):
    truth = {k: v for k, v in simulated.truth["parameters"].items() if k in doggy.parameters}
    timeline = Timeline.of(simulated.recording)
    predictor = Predictor(doggy.with_values(truth), timeline)
    first = int(np.searchsorted(simulated.state_times, timeline.ticks[0] + 1e-9) - 1)
    x = simulated.states[first + 3000][None]
    for step, _, after in predictor.paths(x, np.array([3000]), 500):
        end = (step, after)
    expected = simulated.states[first + 3000 + 500]
    np.testing.assert_allclose(end[1][0], expected, atol=2e-5)


def test_long_command_gaps_are_divided_and_the_command_acts_on():
    times = np.array([0.0, 0.001, 0.002, 0.012, 0.013, 0.014])
    u = np.arange(6.0)[:, None]
    sensor = Stream("motor_encoder", np.linspace(0, 0.014, 15), np.zeros((15, 1)), ("a",), "rad")
    streams = {"command": Stream("command", times, u, ("c",), "1"), "motor_encoder": sensor}
    timeline = Timeline.of(Recording("x", "", 0, streams))
    assert np.max(timeline.h) < 1.6e-3
    acting = timeline.u[:, 0]
    assert acting[np.searchsorted(timeline.ticks, 0.0069) - 1] == 2.0
    assert np.all(np.diff(acting) >= 0)
