# SPDX-License-Identifier: BSD-3-Clause
"""An elastic lever that can be recorded in every kind: moved, shaken and seen in MuJoCo, at rest worked out by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lever_arm import URDF
from scipy.optimize import brentq

from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.rests.rests import Rests
from jointscope.tools.bags.at_poses.read_shaken import read_shaken
from jointscope.tools.bags.at_poses.write_shaken import write_shaken
from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses
from jointscope.tools.simulator.simulation import simulate

YAML = """
format: 1
name: lever_of_all_kinds
urdf: lever.urdf
gravity: [0.0, 0.0, -9.81]
joints: [swing]
command: {topic: /u, type: sensor_msgs/msg/JointState, field: effort, unit: N m}
sensors:
  motor_angle: {kind: motor_encoder, topic: /m, type: sensor_msgs/msg/JointState, field: position, unit: rad,
                sigma: 1.0e-5}
  link_angle: {kind: link_encoder, topic: /l, type: sensor_msgs/msg/JointState, field: position, unit: rad,
               sigma: 2.0e-5}
poses: {target: hook, tracker: base, sigma: 1.0e-5, repeatability: 1.0e-5, length_sigma: 1.0e-3, angle_sigma: 1.0e-3}
frequency: {joints: [swing]}
parameters:
  swing.coulomb_torque: {value: 0.2, unit: N m, prior_sigma: 0.2}
  swing.inertia: {value: 0.2, unit: kg m2, fixed: true}
  swing.stiffness: {value: 1000.0, unit: N m/rad, prior_sigma: 600.0}
  swing.damping: {value: 0.4, unit: N m s/rad, prior_sigma: 0.6}
  swing.motor_viscous.coefficient: {value: 0.2, unit: N m s/rad, prior_sigma: 0.2}
effects: [motor_viscous@swing]
noise: {link_velocity: [0.3], motor_velocity: [0.3]}
"""
SIGMA = 2e-5  # [rad] of the encoder on the link
AT, LINK = 0.5, 0.3  # [m] of the hook and of the centre of mass


def lever_of_all_kinds(folder: Path) -> Robot:
    """The robot file."""
    (folder / "lever.urdf").write_text(URDF, encoding="utf-8")
    (folder / "lever.yaml").write_text(YAML, encoding="utf-8")
    return load_robot(folder / "lever.yaml")


class Lever:
    """One lever: the same seed is the same lever in every kind.

    Args:
        folder: where to write what is shaken.
        seed: of the lever.
        load: mass at the hook that the model does not know [kg].
        gap: half of the gap of its drive [rad].
    """

    def __init__(self, folder: Path, seed: int = 3, load: float = 0.0, gap: float = 0.0):
        self.folder, self.seed, self.load, self.gap = folder, seed, load, gap
        self.robot = lever_of_all_kinds(folder)
        loaded = [f"payload@robot:mass={load}"] if load else []
        self.effects = loaded + ([f"backlash@swing:half_gap={gap}"] if gap else [])
        self.conditions = PoseConditions(effects=self.effects, perfect=True)
        self.truth: dict[str, float] = simulate_poses(self.robot, 1, seed, self.conditions)[1]["parameters"]

    def moved(self, seconds: float = 8.0, seed: int | None = None) -> Recording:
        """In motion."""
        own = {n: v for n, v in self.truth.items() if n in self.robot.parameters and "motor_viscous" not in n}
        turning = f"motor_viscous@swing:coefficient={self.truth['swing.motor_viscous.coefficient']}"
        effects = [turning, *self.effects]
        made = {"seconds": seconds, "seed": self.seed if seed is None else seed, "parameters": own, "effects": effects}
        return simulate(self.robot, friction="smooth", **made).recording

    def seen(self, count: int = 40, session: str = "poses"):
        """At rest, by a tracker."""
        return simulate_poses(self.robot, count, self.seed, self.conditions, session)[0]

    def shaken(self):
        """Shaken in two poses."""
        shaking = Shaking(poses=[np.array([0.4]), np.array([-0.9])], realisations=1)
        made, _, _ = simulate_frequency(self.robot, self.seed, self.conditions, shaking)
        bags = [(one.name, one.signals, one.command) for one in made]
        write_shaken(self.folder / "both", self.robot, bags, made[0].excitation, "")
        return tuple(read_shaken(self.folder / "both" / f"frequency_{k}.mcap", self.robot) for k in (1, 2))

    def hanging(self, count: int = 40, seed: int = 5) -> Rests:
        """With weights on the hook, pulled sideways by a rope over a pulley; friction anywhere in its band."""
        rng = np.random.default_rng(seed)
        pull = rng.choice([0.0, 4.0, 8.0, 12.0, -4.0, -8.0, -12.0], count)
        K, dry = self.truth["swing.stiffness"], self.truth["swing.coulomb_torque"]
        motor, link, u = np.zeros((3, count, 1))
        for k in range(count):

            def weight(q, k=k):
                heavy = 2.0 * LINK + self.load * AT
                return -9.81 * heavy * np.sin(q) - pull[k] * AT * np.cos(q)

            q = rng.uniform(-1.0, 1.0)
            tau = weight(q)
            d = brentq(lambda d, tau=tau: K * d - tau, -0.5, 0.5) + np.sign(tau) * self.gap
            link[k], motor[k] = q + SIGMA * rng.normal(), q - d
            u[k] = -tau + dry * rng.uniform(-1.0, 1.0)
        zero = np.zeros((count, 1))
        forces = np.column_stack([pull, 0.0 * pull, 0.0 * pull])
        return Rests(
            "bench", "", np.zeros((count, 2)), motor, link, u, zero, zero, zero, forces,
            ("hook",) * count, np.ones((count, 1), dtype=bool), zero,
        )  # fmt: skip

    def recordings(self, *kinds: str) -> KindsRecordings:
        """Recordings for training."""
        return KindsRecordings(
            (self.moved(),) if "motion" in kinds else (),
            (self.seen(),) if "poses" in kinds else (),
            self.shaken() if "frequency" in kinds else (),
            (self.hanging(),) if "rests" in kinds else (),
        )

    def held(self, *kinds: str) -> KindsRecordings:
        """Others of the same lever."""
        return KindsRecordings(
            (self.moved(5.0, self.seed + 40),) if "motion" in kinds else (),
            (self.seen(20, "others"),) if "poses" in kinds else (),
            (),
            (self.hanging(20, 17),) if "rests" in kinds else (),
        )
