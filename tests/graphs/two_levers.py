# SPDX-License-Identifier: BSD-3-Clause
"""Two rods that swing about level, parallel axes behind springs; equilibria are worked out by hand.

The file says that the lower rod weighs 0.8 kg; in truth it is 1 kg. Angles count from hanging.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]
URDF = """<robot name="two"><link name="base"/>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
 <limit effort="100" velocity="20" lower="-3" upper="3"/></joint>
<link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="2"/>
 <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="b" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/>
 <limit effort="100" velocity="20" lower="-3" upper="3"/></joint>
<link name="lower"><inertial><origin xyz="0 0 -0.25"/><mass value="0.8"/>
 <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
YAML = """
format: 1
name: two
urdf: two.urdf
gravity: [0.0, 0.0, -9.81]
joints: [a, b]
command: {topic: /u, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  motor_angle: {kind: motor_encoder, topic: /m, type: sensor_msgs/msg/JointState, field: position, unit: rad,
                sigma: 1.0e-5}
  link_angle: {kind: link_encoder, topic: /l, type: sensor_msgs/msg/JointState, field: position, unit: rad,
               sigma: 2.0e-3}
parameters:
  a.coulomb_torque: {value: 0.2, unit: N m, prior_sigma: 2.0}
  b.coulomb_torque: {value: 0.2, unit: N m, prior_sigma: 2.0}
  a.inertia: {value: 0.2, unit: kg m2, fixed: true}
  b.inertia: {value: 0.2, unit: kg m2, fixed: true}
  a.stiffness: {value: 60.0, unit: N m/rad, prior_sigma: 100.0}
  b.stiffness: {value: 30.0, unit: N m/rad, prior_sigma: 100.0}
  a.damping: {value: 0.1, unit: N m s/rad, fixed: true}
  b.damping: {value: 0.1, unit: N m s/rad, fixed: true}
  a.link_mass.mass: {value: 0.0, unit: kg, prior_sigma: 2.0, positive: false}
  a.link_mass.x: {value: 0.0, unit: kg m, fixed: true, positive: false}
  a.link_mass.y: {value: 0.0, unit: kg m, fixed: true, positive: false}
  a.link_mass.z: {value: 0.0, unit: kg m, fixed: true, positive: false}
  b.link_mass.mass: {value: 0.0, unit: kg, prior_sigma: 1.0, positive: false}
  b.link_mass.x: {value: 0.0, unit: kg m, fixed: true, positive: false}
  b.link_mass.y: {value: 0.0, unit: kg m, fixed: true, positive: false}
  b.link_mass.z: {value: 0.0, unit: kg m, fixed: true, positive: false}
effects: [link_mass@a, link_mass@b]
derived:
  gravity.beta1: {unit: N m, gravity: {a: 1, b: -1}, at: [1.5707963267948966, 0]}
  gravity.beta2: {unit: N m, gravity: {b: 1}, at: [1.5707963267948966, 0]}
noise: {link_velocity: [0.3, 0.3], motor_velocity: [0.3, 0.3]}
"""
STIFFNESS, DRY = np.array([40.0, 25.0]), np.array([0.15, 0.1])
BETA1, BETA2 = 9.81 * (2.0 * 0.2 + 1.0 * 0.4), 9.81 * 1.0 * 0.25


def two_levers(folder: Path) -> Robot:
    """The robot with start values far from the truth."""
    (folder / "two.urdf").write_text(URDF, encoding="utf-8")
    (folder / "two.yaml").write_text(YAML, encoding="utf-8")
    return load_robot(folder / "two.yaml")


def resting_at(q: Array, seed: int) -> Rests:
    """Rests at some angles, shape (m, 2) [rad], without weights; friction anywhere in its band."""
    rng = np.random.default_rng(seed)
    lower = -BETA2 * np.sin(q[:, 0] + q[:, 1])
    weight = np.column_stack([-BETA1 * np.sin(q[:, 0]) + lower, lower])
    motor, zero = q - weight / STIFFNESS, np.zeros_like(q)
    u = -weight + DRY * rng.uniform(-1.0, 1.0, q.shape)
    return Rests(
        "two", "", np.zeros((len(q), 2)), motor, q + 2e-3 * rng.normal(size=q.shape), u, zero, zero, zero,
        np.zeros((len(q), 3)), ("",) * len(q), np.ones(q.shape, dtype=bool), zero,
    )  # fmt: skip


def hardly_raised(seed: int, count: int = 12) -> Rests:
    """Rests with the lower rod almost hanging: its weight is hardly felt."""
    rng = np.random.default_rng(1000 + seed)
    upper = rng.uniform(-0.8, 0.8, count)
    return resting_at(np.column_stack([upper, -0.8 * upper + rng.uniform(-0.1, 0.1, count)]), seed)
