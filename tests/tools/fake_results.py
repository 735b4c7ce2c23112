# SPDX-License-Identifier: BSD-3-Clause
"""Results as a calibration and a comparison would give them, made from sinusoids without solving anything."""

from __future__ import annotations

import dataclasses

import numpy as np

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibration_result import (
    BagFit,
    CalibrationResult,
    ChannelFit,
    ParameterEstimate,
    WeakDirection,
)
from jointscope.graphs.calibration.stages.history import IterationRecord
from jointscope.graphs.calibration.stages.residual_series import ResidualSeries
from jointscope.graphs.comparison.comparison_result import (
    ChannelComparison,
    ComparisonResult,
    ModelComparison,
    SensorPrediction,
    WorstWindow,
)
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.recordings.recording import Notice, Recording, Stream

HORIZONS = ("0.01", "0.1", "1.0", "open_loop")


def sinusoids(t, robot):
    """States (q_link, v_link, q_motor, v_motor) of slow, then fast, then chirping motion."""
    t = t[:, None]
    phase = np.array([0.0, 1.1, 2.3])[: robot.n]
    base = 2 * np.pi * (0.15 + 0.05 * np.arange(robot.n))
    rate = base * (1.0 + 3.0 * t / t[-1])
    angle = base * (t + 1.5 * t**2 / t[-1]) + phase
    amplitude = np.array([0.9, 0.5, 0.6])[: robot.n]
    q, v = amplitude * np.sin(angle), amplitude * rate * np.cos(angle)
    a = -amplitude * rate**2 * np.sin(angle)
    deflection = -a * np.array([1.0, 0.5, 0.5])[: robot.n] / 150.0
    return np.hstack([q + deflection, v, q, v])


def fake_recording(robot, x, t, rng, name="runs/train <1>.mcap"):
    n = robot.n
    encoder = robot.motor_encoder
    streams = {
        "command": Stream("command", t, np.sign(x[:, 3 * n :]) * 0.6, tuple(f"{j}.command" for j in robot.joints), "1"),
        encoder.name: Stream(
            encoder.name,
            t,
            x[:, 2 * n : 3 * n] + rng.normal(0, encoder.sigmas[0], (len(t), n)),
            encoder.channels,
            "rad",
        ),
    }
    for gyro in robot.gyros:
        clean = predicted_rate(robot, gyro, x)
        streams[gyro.name] = Stream(
            gyro.name, t, clean + rng.normal(0, gyro.sigma, clean.shape), gyro.channels, "rad/s"
        )
    notices = [Notice("imu1", "gap", 12, "imu1: 12 samples are missing between 1.200 s and 1.212 s")]
    return Recording(name, "0123456789abcdef" * 4, 1_700_000_000_000_000_000, streams, notices)


def predicted_rate(robot, gyro, x):
    n = robot.n
    omega, _, _ = robot.tree.body_rate(gyro.body, x[:, :n], x[:, n : 2 * n])
    return omega @ gyro.R_imu_body.T + gyro.bias


def fake_bag_fit(robot, recording, x, t, rng):
    n, m = robot.n, len(t)
    residuals = {}
    for name, sensor in robot.sensors.items():
        stream = recording.streams[name]
        predicted = x[:, 2 * n : 3 * n] if name == robot.motor_encoder.name else predicted_rate(robot, sensor, x)
        sigma = np.broadcast_to(sensor.sigmas, stream.values.shape).copy()
        residuals[name] = ResidualSeries(stream.channels, sensor.units, t, stream.values, predicted, sigma)
    size = np.repeat([8e-5, 9e-3, 4e-5, 7e-3], n)
    sigmas = size * (1.0 + 0.2 * np.sin(t[:, None] + np.arange(4 * n)))
    process_sigma = np.full((m - 1, 2 * n), 3e-3)
    process = rng.normal(size=(m - 1, 2 * n)) * process_sigma
    commands = recording.command.values
    return BagFit(recording, Calibration.of(robot), t, commands, x, sigmas, residuals, process, process_sigma)


def fake_parameters(robot):
    found = []
    for i, p in enumerate(robot.parameters.values()):
        value = p.published or p.value
        sigma = value * (0.002, 0.06, 0.3)[i % 3 if i < 6 else 0]
        found.append(ParameterEstimate(p.name, value, sigma, p.unit, p.value, p.prior, p.prior_sigma, p.published))
    for gyro in robot.gyros:
        for k, axis in enumerate("xyz"):
            held = gyro.name == "imu1" and axis == "z"
            sigma = 0.1 if held else 2e-4
            note = "not observable here; held by its prior" if held else ""
            found.append(
                ParameterEstimate(
                    f"{gyro.name}.R_imu_body.{axis}",
                    0.0 if held else 0.03 + 0.01 * k,
                    sigma,
                    "rad",
                    0.0,
                    0.0,
                    0.1,
                    None,
                    note,
                )
            )
    for gyro in robot.gyros:
        for k, axis in enumerate("xyz"):
            b = float(gyro.bias[k])
            found.append(ParameterEstimate(f"{gyro.name}.bias.{axis}", b + 1e-4, 1.2e-5, "rad/s", b, b, 0.1))
    return tuple(found)


def fake_calibration(seconds=2.0, seed=0, bags=1):
    """A calibration of Doggy that went well; `seconds` at 1 kHz."""
    rng = np.random.default_rng(seed)
    robot = load_robot("doggy")
    t = np.arange(round(1000 * seconds)) * 1e-3
    x = sinusoids(t, robot)
    fits = []
    for i in range(bags):
        recording = fake_recording(robot, x, t, rng, "runs/train <1>.mcap" if i == 0 else f"runs/train {i + 1}.mcap")
        fits.append(fake_bag_fit(robot, recording, x, t, rng))
    parameters = fake_parameters(robot)
    names = tuple(p.name for p in parameters)
    mix = rng.normal(size=(len(names), len(names))) + 4.0 * np.eye(len(names))
    mix[0:3, 0] += 12.0
    covariance = mix @ mix.T
    scale = np.sqrt(np.diag(covariance))
    noise = ProcessNoise(True, "integrated", np.array([0.012, 0.011, 0.013]), np.array([0.008, 0.009, 0.0085]))
    weak = WeakDirection(
        {"motor.k_pwm": 1.0, "motor.k_mi": 1.0, "motor.inertia": 0.99, "joint1.coulomb_torque": 0.98},
        0.062,
        "motor.k_pwm, motor.k_mi, motor.inertia and the friction torques scale together, ±6.2 %.",
    )
    channels = {
        c: ChannelFit(s.sigmas[0] * 1.01, s.sigmas[0], 1.0 + 0.04 * k, s.units[0])
        for s in robot.sensors.values()
        for k, c in enumerate(s.channels)
    }
    iterations = [IterationRecord("windows", 10 ** (7 - 0.4 * k), 1e-3, 10 ** (2 - 0.4 * k)) for k in range(6)]
    iterations += [IterationRecord("whole", 3e5 * (1 + 10 ** (1 - k)), 1e-6, 10 ** (1 - k)) for k in range(5)]
    values = {p.name: p.value for p in parameters if p.name in robot.parameters}
    return CalibrationResult(
        robot=dataclasses.replace(robot.with_values(values), noise=noise),
        start=robot,
        bags=tuple(fits),
        parameters=parameters,
        names=names,
        correlation=covariance / np.outer(scale, scale),
        weak_directions=(weak,),
        channels=channels,
        noise=noise,
        sigma_inflation={p.name: 1.1 for p in parameters},
        iterations=tuple(iterations),
        cost=3.01e5,
        samples=9 * len(t) * bags,
        recording_seconds=seconds * bags,
        wall_seconds=3.4,
        findings=(
            "All channels fit within their noise.",
            "The yaw of imu1 about joint1 cannot be observed while the bearing is rigid & is held by its prior.",
        ),
    )


def fake_model(label, robot, recording, x, t, quality, rng):
    sensors, channels = {}, {}
    for name, sensor in robot.sensors.items():
        stream = recording.streams[name]
        encoder = name == robot.motor_encoder.name
        clean = x[:, 2 * robot.n : 3 * robot.n] if encoder else predicted_rate(robot, sensor, x)
        drift = quality * (2e-2 * t[:, None] if encoder else 0.03 * np.sin(9 * t[:, None]))
        ahead = clean + quality * 2 * sensor.sigmas * np.sin(40 * t[:, None]) * (1 + (t[:, None] > 0.7 * t[-1]))
        ahead[t < 0.1] = np.nan
        sensors[name] = SensorPrediction(
            stream.channels, sensor.units, sensor.sigmas, t, stream.values, clean + drift, ahead
        )
        for k, channel in enumerate(stream.channels):
            sizes = {h: sensor.sigmas[k] * (1.1 + quality * (1 + 0.2 * k) * 6**i) for i, h in enumerate(HORIZONS)}
            channels[channel] = ChannelComparison(sizes, 99.5 - 8 * quality, sensor.sigmas[k], sensor.units[k])
    end = float(t[-1])
    worst = tuple(
        WorstWindow(c, end * a, end * a + 0.25, s)
        for c, a, s in (("imu1.x", 0.72, 0.11), ("imu2.y", 0.8, 0.06), ("joint3.motor_position", 0.3, 0.02))
    )
    return ModelComparison(label, robot, 1.2 + 2.1 * quality, 1.15, channels, worst, sensors)


def fake_comparison(seconds=2.0, seed=0):
    """A calibrated model and the model before against one recording."""
    rng = np.random.default_rng(seed)
    robot = load_robot("doggy")
    t = np.arange(round(1000 * seconds)) * 1e-3
    x = sinusoids(t, robot)
    recording = fake_recording(robot, x, t, rng)
    models = (
        fake_model("doggy", robot, recording, x, t, 1.4, rng),
        fake_model("doggy_calibrated <b>.yaml", robot, recording, x, t, 0.05, rng),
    )
    return ComparisonResult(recording, models)


def fake_calibration_with_effects(seconds=0.5):
    """The same with a soft bearing, whose hinges are coordinates of their own, and a friction with a memory."""
    result = fake_calibration(seconds)
    robot = result.robot
    for label in ("bearing_flexibility@joint1", "hysteresis@joint2"):
        robot = add_effect(robot, label)
    layout, rng = robot.layout, np.random.default_rng(1)

    def grown(bag):
        x = layout.from_joints(bag.states)
        x[:, layout.n_link - 2 : layout.n_link] += 1e-3
        sigmas = 1e-4 + layout.from_joints(bag.sigmas)
        process_sigma = np.full((len(x) - 1, layout.n_rates), 3e-3)
        process = rng.normal(size=process_sigma.shape) * process_sigma
        return dataclasses.replace(bag, states=x, sigmas=sigmas, process=process, process_sigma=process_sigma)

    link, motor = np.full(layout.n_link, 0.01), np.full(layout.n_motor, 0.008)
    noise = dataclasses.replace(result.noise, link_velocity=link, motor_velocity=motor, memory=np.ones(1))
    robot = dataclasses.replace(robot, noise=noise)
    return dataclasses.replace(result, robot=robot, start=robot, bags=tuple(map(grown, result.bags)), noise=noise)
