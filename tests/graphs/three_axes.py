# SPDX-License-Identifier: BSD-3-Clause
"""The robot file of docs/frequency.md with motion and frequency, and recordings of one arm in both kinds."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.calibrated_urdf import move_joints
from jointscope.robots.model.robot import Robot
from jointscope.robots.urdf.urdf_tree import read_urdf, urdf_text
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


def record(
    folder: Path, seed: int = 3, seconds: float = 6.0, softer: float = 1.0, perfect: bool = True
) -> dict[str, float]:
    """Writes the robot file, `moves.mcap` and `both/`; returns the true values.

    Args:
        folder: where to.
        seed: of the arm.
        seconds: of the motion.
        softer: by how much the third drive is softer in the motion.
        perfect: whether its geometry is that of the URDF.
    """
    robot = three_axes(folder)
    shaking = Shaking(poses=[np.array(pose) for pose in POSES], realisations=1)
    made, _, truth = simulate_frequency(robot, seed, PoseConditions(perfect=perfect), shaking)
    bags = [(one.name, one.signals, one.command) for one in made]
    write_shaken(folder / "both", robot, bags, made[0].excitation, "")
    found: dict[str, float] = {name: truth["parameters"][name] for name in robot.parameters}
    own = {n: v for n, v in found.items() if "motor_viscous" not in n}
    own["joint3.stiffness"] /= softer
    turning = {name.split(".")[0]: value for name, value in found.items() if "motor_viscous" in name}
    effects = [f"motor_viscous@{joint}:coefficient={value}" for joint, value in turning.items()]
    true = robot if perfect else _misplaced(folder, robot, truth["parameters"])
    moved = simulate(true, seconds=seconds, seed=seed, effects=effects, parameters=own, friction="smooth")
    write_bag(folder / "moves.mcap", moved.recording, robot)
    return found


def geometry_in_doubt(folder: Path) -> Robot:
    """The robot of a folder, whose file says that errors of its geometry are values, too."""
    text = (folder / "three_axes.yaml").read_text(encoding="utf-8")
    section = "poses: {target: reflector, tracker: tracker, sigma: 1.0e-5, length_sigma: 1.0e-3, angle_sigma: 3.0e-3}\n"
    path = folder / "in_doubt.yaml"
    path.write_text(text.replace("effects: [", section + "effects: ["), encoding="utf-8")
    return load_robot(path)


def _misplaced(folder: Path, robot: Robot, errors: dict[str, float]) -> Robot:
    """The robot with the URDF of an arm that has these errors."""
    root = read_urdf(robot.tree.urdf)
    values = {name: SimpleNamespace(value=error) for name, error in errors.items()}
    move_joints(
        root,
        SimpleNamespace(
            poses=SimpleNamespace(link=None, tracker_link=None, targets=(), others=()),
            parameters=values,
            values=errors,
            tree=robot.tree,
        ),
    )
    (folder / "true.urdf").write_text(urdf_text(root), encoding="utf-8")
    text = robot.path.read_text(encoding="utf-8").replace("ready:tx90l/tx90l.urdf", "true.urdf")
    (folder / "true.yaml").write_text(text, encoding="utf-8")
    return load_robot(folder / "true.yaml")


if __name__ == "__main__":
    record(Path.cwd())
