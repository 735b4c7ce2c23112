# SPDX-License-Identifier: BSD-3-Clause
"""What a diagnosis and a discovery of a Doggy with a soft bearing would find, made from sinusoids without solving."""

from __future__ import annotations

import dataclasses

import numpy as np
from fake_results import fake_model, fake_recording, sinusoids

from jointscope.graphs.comparison.failure_analysis import ChannelFailure, FailureAnalysis
from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis, EffectEstimate
from jointscope.graphs.discovery.discovery_result import Discovery, DiscoveryStep
from jointscope.graphs.discovery.missing_torque import MissingTorque
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

BEARING = "bearing_flexibility@joint1"
REGIMES = ("standstill", "reversal", "fast", "loaded", "other")
SIGNALS = ("velocity", "sign(velocity)", "position", "deflection", "load", "command")
SENTENCES = (
    "Gyro 1 sees 0.21 rad/s about its x axis where the model allows none, most of it when joint 2 reverses",
    "imu2.y is 24 sigma off while joint 2 is fast",
)


def fake_inputs(seconds=2.0, seed=0):
    """Robot, motion and two recordings with different hashes."""
    rng = np.random.default_rng(seed)
    robot = load_robot("doggy")
    t = np.arange(round(1000 * seconds)) * 1e-3
    x = sinusoids(t, robot)
    train = fake_recording(robot, x, t, rng, "runs/train <1>.mcap")
    test = dataclasses.replace(fake_recording(robot, x, t, rng, "runs/test.mcap"), sha256="fedcba9876543210" * 4)
    return robot, t, x, train, test, rng


def estimate(value, sigma, unit):
    return EffectEstimate(value, sigma, unit)


def fake_candidates(found=True):
    """As for the base model if `found`, else as for the model with the bearing."""
    bearing = Candidate(
        "bearing_flexibility", "joint1", 3.1e6, 2, 1e-12,
        {"compliance_x": estimate(4.02e-4, 6.1e-6, "rad/(N m)"),
         "compliance_y": estimate(3.87e-4, 5.5e-6, "rad/(N m)")},
        "missing", 0.984, True, 1.24, 1.23, -4.2e5, ("gyro_scale@imu1",),
        ("Its refit removes 98 % of the unexplained error on validation blocks.", "Both compliances are positive."),
    )  # fmt: skip
    others = [
        Candidate("gyro_scale", "imu1", 8.9e5, 3, 1e-9, {"xx": estimate(0.31, 0.02, "1")}, "possible", 0.12, True,
                  11.4, 12.9, -2.1e3, (BEARING,), ("The held-out error grows.", "The bearing explains more.")),
        Candidate("motor_viscous", "joint2", 2.4e3, 1, 0.004, {"coefficient": estimate(-0.52, 0.03, "N m s/rad")},
                  "absent", 0.001, True, 12.1, 13.2, 4.0, ("link_viscous@joint2",), ("Its sign is not physical.",)),
        Candidate("spring_cubic", "joint1", 31.0, 1, 0.21, {"cubic": estimate(2.1e3, 1.9e3, "N m/rad³")}, "absent",
                  reasons=("As large a score comes by chance.",)),
        Candidate("cogging", "joint3", 12.0, 2, 0.8, {"cos": estimate(0.01, 0.04, "N m")}, "absent"),
        Candidate("gravity_imbalance", "joint2", 0.4, 1, 0.9, {"torque": estimate(0.1, 4.0, "N m")}, "untestable",
                  reasons=("A torque of 2 N m would not show: joint 2 moves only 4 degrees.",)),
        Candidate("integration_error", "robot", 61.0, 1, 0.02, {}, "absent", numerics=True),
    ]  # fmt: skip
    if found:
        return (bearing, *others)
    return tuple(
        dataclasses.replace(c, verdict="untestable" if c.verdict == "untestable" else "absent") for c in others
    )


def fake_failure(robot, size, rng):
    channels = {}
    for k, channel in enumerate(robot.channels):
        error = 1.05 + size * (24.0 if "imu1.x" in channel else 18.0 / (1 + k))
        shares = rng.dirichlet(np.ones(len(REGIMES)))
        channels[channel] = ChannelFailure(
            error,
            {r: error * (0.4 + 2.0 * s) for r, s in zip(REGIMES, shares, strict=True)},
            dict(zip(REGIMES, shares.tolist(), strict=True)),
            {r: "joint2" if r in ("reversal", "fast") else "" for r in REGIMES},
            min(0.1 + 0.8 * size, 0.97),
            1e-30 if size > 0.5 else 0.3,
            {f"{j}.{s}": float(np.tanh(size * rng.normal())) * 0.9 for j in robot.joints for s in SIGNALS},
        )
    worst_first = dict(sorted(channels.items(), key=lambda item: -item[1].error))
    time = {"standstill": 0.1, "reversal": 0.15, "fast": 0.4, "loaded": 0.2, "other": 0.15}
    return FailureAnalysis(worst_first, time, SENTENCES if size > 0.5 else ())


def fake_missing(robot, t, x, size, rng):
    """Torque on the links of joints 2 and 3 that follows their acceleration, smooth noise everywhere."""
    n, keep = robot.n, slice(None, None, 2)
    t, x = t[keep], x[keep]
    q_link, v_link, q_motor, v_motor = (x[:, k * n : (k + 1) * n] for k in range(4))
    stiffness = np.array([robot.parameter(f"{j}.stiffness").value for j in robot.joints])
    tau_spring = stiffness * (q_link - q_motor)
    noise = rng.normal(size=(len(t), 2 * n))
    kernel = np.exp(-0.5 * np.linspace(-3, 3, 41) ** 2)
    smooth = np.column_stack([np.convolve(column, kernel / kernel.sum(), "same") for column in noise.T])
    effect = np.zeros((len(t), 2 * n))
    effect[:, 1] = size * (0.9 * v_link[:, 1] * np.abs(v_link[:, 1]) + 0.3 * tau_spring[:, 2] / stiffness[2] * 100)
    effect[:, 2] = size * 0.02 * tau_spring[:, 2]
    torque = effect + 0.25 * smooth
    rows = (*(f"{j}.link" for j in robot.joints), *(f"{j}.motor" for j in robot.joints))
    explained = {BEARING: effect, "gyro_scale@imu1": 0.3 * effect} if size > 0.5 else {}
    sigma = np.full_like(torque, 0.06)
    return MissingTorque(robot.joints, rows, t, torque, sigma, q_link, v_link, q_motor, v_motor, tau_spring,
                         0.9 * tau_spring, explained)  # fmt: skip


def fake_diagnosis(seconds=2.0, seed=0, found=True, held_out=True):
    """Of the base model if `found`, else of the model with the bearing, which is adequate."""
    robot, t, x, train, test, rng = fake_inputs(seconds, seed)
    comparison = fake_model("doggy", robot, test if held_out else train, x, t, 5.7 if found else 0.02, rng)
    error, floor = (13.21, 1.2) if found else (1.23, 1.21)
    paragraphs = (
        "One effect is missing: bearing_flexibility at joint1, a soft bearing. With it the error on unseen blocks "
        "falls from 12.3 to 1.24 sigma, of which 1.20 are noise.",
        "gyro_scale@imu1 looks alike in these recordings, but does not lower the held-out error.",
    )
    quiet = ("Nothing physical is missing: 5 % of the squared error at most is unexplained.",)
    return Diagnosis(
        robot=robot,
        candidates=fake_candidates(found),
        adequate=not found,
        unexplained_share=1.0 - (floor / error) ** 2,
        error=error,
        floor=floor,
        validation_error=12.3 if found else 1.26,
        failure=fake_failure(robot, 1.0 if found else 0.05, rng),
        missing=fake_missing(robot, t, x, 1.0 if found else 0.0, rng),
        noise_levels={f: (BEARING, "gyro_scale@imu1", "motor_viscous@joint2") for f in (0.1, 1.0, 10.0)},
        placebo_score=14.0,
        paragraphs=paragraphs if found else quiet,
        comparison=comparison,
        wall_seconds={"calibrate": 8.1, "score": 3.9, "refit": 41.0},
        recordings=(train,),
        heldout=test if held_out else None,
    )


def fake_steps(seconds=2.0, held_out=True):
    nan = float("nan")
    before, after = fake_diagnosis(seconds, 0, True, held_out), fake_diagnosis(seconds, 1, False, held_out)
    base = DiscoveryStep(None, None, before.robot, 12.3, 13.21 if held_out else nan, 1.2, before,
                         dataclasses.replace(before.comparison, label="base model"), "",
                         "The calibrated base model is 13.2 sigma off; noise alone would give 1.20.")  # fmt: skip
    final = DiscoveryStep(BEARING, None, with_bearing(after.robot), 1.24, 1.23 if held_out else nan, 1.21, after,
                          dataclasses.replace(after.comparison, label=f"+ {BEARING}"), "",
                          "With a soft bearing at joint1 the model predicts as well as the sensors allow.")  # fmt: skip
    return base, final


def with_bearing(robot):
    """The robot with a soft bearing, as if calibrated."""
    found = {"joint1.bearing_flexibility.compliance_x": 4.02e-4, "joint1.bearing_flexibility.compliance_y": 3.87e-4}
    bearing = add_effect(robot, BEARING).with_values(found)
    parameters = dict(bearing.parameters)
    for name, p in parameters.items():
        parameters[name] = dataclasses.replace(p, sigma=0.015 * (abs(p.value) or 0.1) if p.effect else 0.002 * p.value)
    return dataclasses.replace(bearing, parameters=parameters)


def fake_discovery(seconds=2.0, held_out=True):
    """Two steps: the base model, and the bearing."""
    steps = fake_steps(seconds, held_out)
    diagnosis = steps[0].diagnosis
    return Discovery(steps, "The model is adequate.", True, "", held_out, diagnosis.recordings, diagnosis.heldout)
