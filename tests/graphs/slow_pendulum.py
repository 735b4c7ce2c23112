# SPDX-License-Identifier: BSD-3-Clause
"""A pendulum on a geared motor, seen by one encoder, integrated here by Runge-Kutta in small steps."""

from __future__ import annotations

import math

import numpy as np

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream

URDF = """<robot name="pendulum"><link name="base"/>
<joint name="swing" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
 <limit effort="100" velocity="20" lower="-3" upper="3"/></joint>
<link name="rod"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>
 <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""

YAML = """
format: 1
name: pendulum
urdf: pendulum.urdf
gravity: [0.0, 0.0, -9.81]
joints: [swing]
model: {{rigid_joints: [swing]}}
command: {{topic: {topic}, type: sensor_msgs/msg/JointState, field: effort, unit: A{held}}}
sensors:
  enc: {{kind: motor_encoder, topic: /js, type: sensor_msgs/msg/JointState, field: position, unit: rad,
        sigma: {sigma:.8f}{keep}}}
parameters:
  swing.coulomb_torque: {{value: 0.8, unit: N m, prior_sigma: 2.0}}
  swing.inertia: {{value: 0.2, unit: kg m2, prior_sigma: 0.5}}
  swing.torque_constant: {{value: 1.0, unit: N m/A, prior_sigma: 3.0}}
  swing.motor_viscous.coefficient: {{value: 0.3, unit: N m s/rad, prior: 0.0, prior_sigma: 10.0, positive: false,
                                    'null': 0.0}}
noise: {{link_velocity: [0.3], motor_velocity: [0.3]}}
effects: [motor_viscous@swing]
"""
TRUTH = {
    "swing.coulomb_torque": 0.5,
    "swing.inertia": 0.1,
    "swing.torque_constant": 2.0,
    "swing.motor_viscous.coefficient": 0.4,
}
FINE = 2e-4  # [s]


def pendulum(folder, sigma, topic="/cmd", held="", keep=""):
    """The robot with start values far from the truth."""
    (folder / "pendulum.urdf").write_text(URDF, encoding="utf-8")
    text = YAML.format(sigma=sigma, topic=topic, held=held, keep=keep)
    (folder / "pendulum.yaml").write_text(text, encoding="utf-8")
    return load_robot(folder / "pendulum.yaml")


def swing(seconds, rate, smooth_drive=False, fast=0.0):
    """Stamps, currents and angles at a rate; the current is held between stamps, or smooth; `fast` at 6 Hz [A]."""
    mu, inertia, k, b = TRUTH.values()
    total = inertia + 0.02 + 2.0 * 0.3**2

    def acceleration(q, v, i):
        return (k * i - b * v - mu * math.tanh(200.0 * v) - 2.0 * 9.81 * 0.3 * math.sin(q)) / total

    def current(t):
        return (
            2.2 * math.sin(4.4 * t)
            + 1.1 * math.sin(9.1 * t + 1.0)
            + 0.7 * math.sin(1.3 * t)
            + fast * math.sin(37.7 * t)
        )

    count, each = int(seconds * rate), round(1.0 / (rate * FINE))
    stamps = np.arange(count) / rate
    currents, angles = np.zeros((count, 1)), np.zeros((count, 1))
    q, v, h = 0.3, 0.0, FINE
    for n in range(count):
        currents[n], angles[n] = current(stamps[n]), q
        for m in range(each):
            t = stamps[n] + m * h
            now, mid, then = (current(t + s) if smooth_drive else currents[n, 0] for s in (0.0, h / 2, h))
            a1 = acceleration(q, v, now)
            a2 = acceleration(q + h / 2 * v, v + h / 2 * a1, mid)
            a3 = acceleration(q + h / 2 * v + h * h / 4 * a1, v + h / 2 * a2, mid)
            a4 = acceleration(q + h * v + h * h / 2 * a2, v + h * a3, then)
            q, v = q + h * v + h * h / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return stamps, currents, angles


def recorded(stamps, currents, angles):
    """Streams of what was measured."""
    command = Stream("command", stamps, currents, ("swing",), "A")
    encoder = Stream("enc", stamps, angles, ("swing.motor_position",), "rad")
    return Recording("swing.mcap", "", 0, {"command": command, "enc": encoder})
