# SPDX-License-Identifier: BSD-3-Clause
"""Hidden effects of an arm of one joint at rest, whose equilibria are worked out here by hand, are named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from jointscope.graphs.rest_search.discover_rests import discover_rests
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.rests.rests import Rests

URDF = """<robot name="lever"><link name="base"/>
<joint name="swing" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
 <limit effort="100" velocity="20" lower="-3" upper="3"/></joint>
<link name="rod"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>
 <inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hook_joint" type="fixed"><parent link="rod"/><child link="hook"/><origin xyz="0 0 -0.5"/></joint>
<link name="hook"/></robot>"""
YAML = """
format: 1
name: lever
urdf: lever.urdf
gravity: [0.0, 0.0, -9.81]
joints: [swing]
command: {topic: /u, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  motor_angle: {kind: motor_encoder, topic: /m, type: sensor_msgs/msg/JointState, field: position, unit: rad,
                sigma: 1.0e-5}
  link_angle: {kind: link_encoder, topic: /l, type: sensor_msgs/msg/JointState, field: position, unit: rad,
               sigma: 2.0e-4}
parameters:
  swing.coulomb_torque: {value: 0.2, unit: N m, prior_sigma: 2.0}
  swing.inertia: {value: 0.2, unit: kg m2, prior_sigma: 0.5}
  swing.stiffness: {value: 60.0, unit: N m/rad, prior_sigma: 100.0}
  swing.damping: {value: 0.1, unit: N m s/rad, prior_sigma: 1.0}
noise: {link_velocity: [0.3], motor_velocity: [0.3]}
"""
K, C0 = 40.0, 0.3
LABELS = (
    "spring_cubic",
    "link_mass",
    "torque_offset",
    "encoder_offset",
    "encoder_eccentricity",
    "torque_constant_error",
)


@dataclass(frozen=True)
class Lever:
    """The true lever: hardening of its spring, mass at the hook, offsets, friction both ways, gain of the drive."""

    hardening: float = 0.0  # [N m/rad^3]
    payload: float = 0.0  # [kg]
    offset: float = 0.0  # [N m]
    zero: float = 0.0  # [rad] of the link encoder
    wave: float = 0.0  # [rad] of the same, twice per turn
    slope: float = 0.0  # [N m] more friction forwards, less backwards
    gain: float = 1.0

    def hanging(self, count: int, seed: int, path: str = "bench") -> Rests:
        """Rests with weights that pull at the hook over a pulley; friction anywhere in its band."""
        rng = np.random.default_rng(seed)
        pull = rng.choice([0.0, 4.0, 8.0, 12.0, -4.0, -8.0, -12.0], count)
        motor, link, u = np.zeros((3, count, 1))
        for k in range(count):
            q = rng.uniform(-1.0, 1.0)
            # torque about the joint that gravity and rope exert, which the spring must balance
            tau = -9.81 * (2.0 * 0.3 + self.payload * 0.5) * np.sin(q) - pull[k] * 0.5 * np.cos(q)
            d = brentq(lambda d, tau=tau: K * d + self.hardening * d**3 - tau, -1.0, 1.0)
            share = rng.uniform(-1.0, 1.0)
            # what friction can hold when the motor is about to move one way or the other
            friction = share * (C0 + self.slope if share > 0.0 else C0 - self.slope)
            motor[k] = q - d + 1e-5 * rng.normal()
            link[k] = q + self.zero + self.wave * np.sin(2.0 * q) + 2e-4 * rng.normal()
            u[k] = (friction - tau - self.offset) / self.gain
        zero = np.zeros((count, 1))
        forces = np.column_stack([pull, 0.0 * pull, 0.0 * pull])
        return Rests(
            path, path, np.zeros((count, 2)), motor, link, u, zero, zero, zero, forces, ("hook",) * count,
            np.ones((count, 1), dtype=bool), zero,
        )  # fmt: skip


HIDDEN = {
    "hardening": (Lever(hardening=400.0), {"spring_cubic@swing", "spring_curve@swing"}),
    "payload": (Lever(payload=0.3), {"link_mass@swing", "gravity_imbalance@swing"}),
    "offset": (Lever(offset=0.2), {"torque_offset@swing", "asymmetric_friction@swing"}),
    "zero": (Lever(zero=0.01), {"encoder_offset@swing.link"}),
    "wave": (Lever(wave=0.01), {"encoder_eccentricity@swing.link"}),
    "friction": (Lever(slope=0.15), {"torque_offset@swing", "asymmetric_friction@swing"}),
    "gain": (Lever(gain=1.15), {"torque_constant_error@swing"}),
}


@pytest.fixture
def lever(tmp_path):
    (tmp_path / "lever.urdf").write_text(URDF, encoding="utf-8")
    (tmp_path / "lever.yaml").write_text(YAML, encoding="utf-8")
    return load_robot(tmp_path / "lever.yaml")


@pytest.mark.parametrize("name", HIDDEN)
def test_a_hidden_effect_is_named_first_and_found_with_its_size(lever, name):
    truth, known = HIDDEN[name]
    found = discover_rests(lever, [truth.hanging(60, 1)], [truth.hanging(30, 2, "other")])
    added = [step.added.label for step in found.steps if step.added]
    assert len(added) == 1 and added[0] in known, added
