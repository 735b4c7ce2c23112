# SPDX-License-Identifier: BSD-3-Clause
"""A bench for an arm of one joint: its robot file, and rests whose equilibria are worked out by hand."""

from __future__ import annotations

import numpy as np
from lever_arm import URDF
from scipy.optimize import brentq

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.rests.rests import Rests

YAML = """
format: 1
name: lever
urdf: lever.urdf
gravity: [0.0, 0.0, -9.81]
joints: [swing]
model: {{rigid_joints: {rigid}}}
command: {{topic: /u, type: sensor_msgs/msg/JointState, field: effort, unit: N m}}
sensors:
  motor_angle: {{kind: motor_encoder, topic: /m, type: sensor_msgs/msg/JointState, field: position, unit: rad,
                sigma: 1.0e-5}}
{link}
parameters:
  swing.coulomb_torque: {{value: 0.2, unit: N m, prior_sigma: 2.0}}
  swing.inertia: {{value: 0.2, unit: kg m2, prior_sigma: 0.5}}
{springs}
effects: [{effects}]
noise: {{link_velocity: [0.3], motor_velocity: [0.3]}}
"""
LINK = """  link_angle: {kind: link_encoder, topic: /l, type: sensor_msgs/msg/JointState, field: position, unit: rad,
         sigma: 2.0e-4}"""
SPRINGS = """  swing.stiffness: {value: 60.0, unit: N m/rad, prior_sigma: 100.0}
  swing.damping: {value: 0.1, unit: N m s/rad, prior_sigma: 1.0}
  swing.spring_curve.quadratic: {value: 0.0, unit: N m/rad^2, prior_sigma: 1.0e+4, positive: false}
  swing.spring_curve.cubic: {value: 0.0, unit: N m/rad^3, prior_sigma: 1.0e+5, positive: false}
  swing.weight_dependent_friction.coefficient: {value: 0.02, unit: '1', prior_sigma: 1.0}
  swing.weight_dependent_friction.quadratic: {value: 0.0, unit: 1/(N m), fixed: true, positive: false}"""
K, K2, K3, C0, C1 = 40.0, -150.0, 900.0, 0.3, 0.1


def lever(folder, rigid=False):
    """The robot with start values far from the truth."""
    (folder / "lever.urdf").write_text(URDF, encoding="utf-8")
    text = YAML.format(
        rigid="[swing]" if rigid else "[]",
        link="" if rigid else LINK,
        springs="" if rigid else SPRINGS,
        effects="" if rigid else "spring_curve@swing, weight_dependent_friction@swing",
    )
    (folder / "lever.yaml").write_text(text, encoding="utf-8")
    return load_robot(folder / "lever.yaml")


def hanging(count, seed, rigid=False, creeping=0):
    """Rests with weights on the hook, pulled sideways by a rope over a pulley; friction anywhere in its band.

    The motor still creeps in the first ones, and friction is all that it can be.
    """
    rng = np.random.default_rng(seed)
    pull = rng.choice([0.0, 4.0, 8.0, 12.0, -4.0, -8.0, -12.0], count)
    motor, link, u, creep = np.zeros((4, count, 1))
    for k in range(count):
        # 2 kg at 0.3 m turn the rod down, a force along x at 0.5 m turns it up against it
        def weight(q, k=k):
            return -2.0 * 9.81 * 0.3 * np.sin(q) - pull[k] * 0.5 * np.cos(q)

        q = rng.uniform(-1.0, 1.0)
        tau = weight(q)
        # the spring pulls the link back: K d + K2 d^2 + K3 d^3 = tau with d = q_link - q_motor
        d = 0.0 if rigid else brentq(lambda d, tau=tau: K * d + K2 * d**2 + K3 * d**3 - tau, -0.5, 0.5)
        share = rng.uniform(-1.0, 1.0)
        if k < creeping:
            share = np.sign(share)
            creep[k] = share * 1e-3
        friction = (C0 + (0.0 if rigid else C1 * abs(tau))) * share
        link[k], motor[k], u[k] = q + 2e-4 * rng.normal() * (not rigid), q - d, -tau + friction
    zero = np.zeros((count, 1))
    forces = np.column_stack([pull, 0.0 * pull, 0.0 * pull])
    return Rests(
        "bench", "", np.zeros((count, 2)), motor, None if rigid else link, u, zero, zero, zero, forces,
        ("hook",) * count, np.ones((count, 1), dtype=bool), creep,
    )  # fmt: skip


def lever_in_sight(folder):
    """The rigid lever with a tracker that sees its hook."""
    path = lever(folder, rigid=True).path
    section = "poses: {target: hook, tracker: base, sigma: 1.0e-5, repeatability: 1.0e-5, length_sigma: 1.0e-3}\n"
    path.write_text(path.read_text(encoding="utf-8").replace("parameters:\n", f"{section}parameters:\n"), "utf-8")
    return load_robot(path)
