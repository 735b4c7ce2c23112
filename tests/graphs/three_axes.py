# SPDX-License-Identifier: BSD-3-Clause
"""The robot file of docs/frequency.md with motion and frequency, and recordings of one arm in both kinds."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.at_poses.write_shaken import write_shaken
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
from jointscope.tools.simulator.pose_simulation import PoseConditions
from jointscope.tools.simulator.simulation import simulate

PAGE = Path(__file__).resolve().parents[2] / "docs" / "frequency.md"
POSES = ([0.1, 0.72, 0.62], [0.1, 0.5, 1.8])


def three_axes(folder: Path) -> Robot:
    """The robot, from the file on the page."""
    page = PAGE.read_text(encoding="utf-8")
    (found,) = re.findall(r"```yaml\n(format: 1\nname: three_axes\n.*?)```", page, re.DOTALL)
    path = folder / "three_axes.yaml"
    path.write_text(found, encoding="utf-8")
    return load_robot(path)


def record(folder: Path, seed: int = 3, seconds: float = 6.0, softer: float = 1.0) -> dict[str, float]:
    """Writes the robot file, `moves.mcap` and `both/`; returns the true values.

    Args:
        folder: where to.
        seed: of the arm; its geometry is that of the URDF.
        seconds: of the motion.
        softer: by how much the third drive is softer in the motion.
    """
    robot = three_axes(folder)
    shaking = Shaking(poses=[np.array(pose) for pose in POSES], realisations=1)
    made, _, truth = simulate_frequency(robot, seed, PoseConditions(perfect=True), shaking)
    bags = [(one.name, one.signals, one.command) for one in made]
    write_shaken(folder / "both", robot, bags, made[0].excitation, "")
    found: dict[str, float] = {name: truth["parameters"][name] for name in robot.parameters}
    own = {n: v for n, v in found.items() if "motor_viscous" not in n}
    own["joint3.stiffness"] /= softer
    turning = {name.split(".")[0]: value for name, value in found.items() if "motor_viscous" in name}
    effects = [f"motor_viscous@{joint}:coefficient={value}" for joint, value in turning.items()]
    moved = simulate(robot, seconds=seconds, seed=seed, effects=effects, parameters=own, friction="smooth")
    write_bag(folder / "moves.mcap", moved.recording, robot)
    return found


if __name__ == "__main__":
    record(Path.cwd())
