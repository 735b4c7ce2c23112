# SPDX-License-Identifier: BSD-3-Clause
"""The ready TX90L under made-up torques: spectra to linearise with, and where the recordings made elsewhere lie."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from jointscope.robots.recordings.signals import Excitation, Experiment, Signal, Signals
from jointscope.tools.bags.write_bag import joint_states, write_topics

TX90L = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "tx90l"
POSE = np.array([0.1, 0.72, 0.62, 1.2, 1.0, 0.3])
RATE, N, LINES = 200.0, 200, np.arange(3, 90, 4)
INERTIA = np.array([40.0, 35.0, 8.0])
CARRIER = 2  # line of the motion beside the excitation


def made_up(seed=0, carrier=0.03):
    """Signals of one realisation of orthogonal pairs, about as an arm would answer, and their excitation."""
    rng = np.random.default_rng(seed)
    w = 2.0 * np.pi * RATE / N * LINES
    t = np.arange(2 * N) / RATE
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(LINES), 3))
    swing = 2.0 * carrier * np.cos(2.0 * np.pi * CARRIER * RATE / N * t)[:, None] * [1.0, 1.1, 0.9]
    us, qs, times, experiments = [], [], [], []
    for e in range(3):
        turn = np.exp(2j * np.pi * np.arange(3) * e / 3.0)
        for sign in (1, -1):
            U = sign * 5.0 * np.exp(1j * phases) * turn
            waves = np.exp(1j * np.outer(t, w))
            start = 3.0 * len(times)
            us.append((waves @ U).real)
            answer = U / (-(w[:, None] ** 2) * INERTIA) * (1.0 + 0.3 * rng.standard_normal(U.shape))
            motors = POSE[:3] + swing + (waves @ answer).real
            qs.append(np.hstack([motors, np.broadcast_to(POSE[3:], (len(t), 3))]))
            times.append(start + t)
            experiments.append(Experiment(0, e, sign, start, 2))
    names = tuple(f"joint{i + 1}" for i in range(6))
    stamps = np.concatenate(times)
    signals = Signals("made", "", Signal(stamps, np.vstack(us), names[:3]), Signal(stamps, np.vstack(qs), names))
    speed = CARRIER * RATE / N if carrier else 0.0
    return signals, Excitation(RATE / N, LINES, tuple(experiments), speed)


def truth(name):
    """True stiffnesses and dampings of a set, by the names of the robot file."""
    elastic = json.loads((TX90L / name / "truth.json").read_text())["elasticity"]
    found = {}
    for j in "123":
        for letter, part in (("c", "stiffness"), ("d", "damping")):
            found[f"joint{j}.{part}"] = elastic[f"{letter}{j}"]
            found |= {f"joint{j}.bearing.{part}_{axis}": elastic[f"{letter}{j}{axis}"] for axis in "xy"}
    return found


def made_up_bag(path):
    """A bag of the made-up arm without a carrier, with torques of all joints."""
    signals, _ = made_up(carrier=0.0)
    stamps = np.rint(signals.outputs.times * 1e9).astype(np.int64) + 1_700_000_000_000_000_000
    torques = np.hstack([signals.inputs.values, np.zeros_like(signals.inputs.values)])
    fields = {"effort": torques, "position": signals.outputs.values}
    write_topics(path, [joint_states("/joint_states", signals.outputs.names, stamps, fields)])
    return path
