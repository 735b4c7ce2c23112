# SPDX-License-Identifier: BSD-3-Clause
"""The arm of three_axes.py at rest: poses with a target, and rests with encoders behind the springs, by MuJoCo."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from three_axes import geometry_in_doubt, three_axes

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.rests.rests import Rests
from jointscope.tools.bags.write_bag import joint_states, write_topics
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

LINK = """  link_encoder: {kind: link_encoder, topic: /link_states, type: sensor_msgs/msg/JointState, field: position,
                 unit: rad, sigma: 4.0e-6}
"""
SIGMA = 4e-6  # [rad] of the encoders behind the springs


def resting_axes(folder: Path) -> Robot:
    """The robot with encoders on both sides of its springs, and a geometry that may be off."""
    three_axes(folder)
    path = geometry_in_doubt(folder).path
    text = path.read_text(encoding="utf-8").replace("frequency:\n  joints", f"{LINK}frequency:\n  joints")
    path.write_text(text, encoding="utf-8")
    return load_robot(path)


def stiff_axes(folder: Path) -> Robot:
    """The same arm with rigid joints, for motion and poses."""
    text = three_axes(folder).path.read_text(encoding="utf-8")
    text = text.replace("{integrator: simpson}", "{rigid_joints: [joint1, joint2, joint3]}")
    poses = geometry_in_doubt(folder).path.read_text(encoding="utf-8")
    section = next(line for line in poses.splitlines() if line.startswith("poses:"))
    text = re.sub(r"frequency:\n  joints.*", section, text)
    path = folder / "stiff_axes.yaml"
    path.write_text(re.sub(r"  joint\d\.(stiffness|damping):.*\n", "", text), encoding="utf-8")
    return load_robot(path)


def posed(robot: Robot, count: int, seed: int, **conditions) -> tuple[Poses, dict[str, float]]:
    """Poses, and the true values of the arm of this seed."""
    poses, truth = simulate_poses(robot, count, seed, PoseConditions(**conditions))
    return poses, truth["parameters"]


def rested(robot: Robot, count: int, seed: int, softer: float = 1.0, **conditions) -> Rests:
    """The same arm at rest, each motor held by friction anywhere in its band.

    Args:
        robot: as of `resting_axes`.
        count: number of rests.
        seed: of the arm.
        softer: by how much the second drive is softer than in the poses.
        conditions: as of `PoseConditions`.
    """
    poses, truth = simulate_poses(robot, count, seed, PoseConditions(**conditions), "rests")
    rng, values = np.random.default_rng(seed), truth["parameters"]
    K = np.array([values[f"{joint}.stiffness"] for joint in robot.joints]) / [1.0, softer, 1.0]
    dry = np.array([values[f"{joint}.coulomb_torque"] for joint in robot.joints])
    zero = np.zeros((count, robot.n))
    return Rests(
        "rests", "", np.zeros((count, 2)), poses.q, poses.q - poses.torque / K + SIGMA * rng.normal(size=zero.shape),
        poses.torque + dry * rng.uniform(-1.0, 1.0, zero.shape), zero, zero, zero, np.zeros((count, 3)),
        ("",) * count, np.ones(zero.shape, dtype=bool), zero,
    )  # fmt: skip


def write_rests(path: Path, rests: Rests) -> Path:
    """A bag in which the arm stands for three seconds at each rest and moves for one in between."""
    rate, (m, n) = 100, rests.u.shape
    stamps = np.arange(4 * rate * m) * (10**9 // rate) + 1_700_000_000_000_000_000
    share = np.clip((np.arange(4 * rate) - 3 * rate) / rate, 0.0, 1.0)[:, None]
    noise = np.random.default_rng(0).normal(size=(2, len(stamps), n))

    def held(values):
        after = np.vstack([values[1:], values[-1:]])
        return np.concatenate([a + share * (b - a) for a, b in zip(values, after, strict=True)])

    names = [f"joint{j + 1}" for j in range(n)]
    sides = {"/joint_states": rests.q_motor, "/link_states": rests.q_link}
    topics = [
        joint_states(topic, names, stamps, {"position": held(q) + sigma * each})
        for (topic, q), each, sigma in zip(sides.items(), noise, (1e-6, SIGMA), strict=True)
    ]
    write_topics(path, [*topics, joint_states("/motor_command", names, stamps, {"effort": held(rests.u)})])
    return path
