# SPDX-License-Identifier: BSD-3-Clause
"""Functions that change a model, write it for other programs, or hold a bag against it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jointscope.robots.errors import EffectError
from jointscope.robots.files.effects_at_once import add_effects, remove_effects
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.descriptions.bag_description import BagDescription
from jointscope.tools.bags.descriptions.describe_bag import describe_bag
from jointscope.tools.export.exported_files import ExportedFiles, export_files
from jointscope.tools.notebook.given import AnyRobot, robot_of


def add(robot: AnyRobot, *effects: str) -> Robot:
    """The robot with more effects, at their start values.

    Args:
        robot: is left as it is.
        effects: ID@OWNER; ID@* for everything that it can act on.

    Raises:
        EffectError: an effect is unknown, is there already, or cannot act there.
    """
    return add_effects(robot_of(robot), _labels(effects)).robot


def remove(robot: AnyRobot, *effects: str) -> Robot:
    """The robot without some effects; the other parameters keep their values, so calibrate again.

    Args:
        robot: is left as it is.
        effects: ID@OWNER; ID@* wherever the robot has it.

    Raises:
        EffectError: an effect is unknown or not there.
    """
    return remove_effects(robot_of(robot), _labels(effects)).robot


def _labels(effects: Sequence[str]) -> Sequence[str]:
    """Effects as they were given.

    Raises:
        EffectError: one is no text, or there is none.
    """
    odd = next((effect for effect in effects if not isinstance(effect, str)), None)
    if odd is not None or not effects:
        got = "none" if odd is None else repr(odd)
        raise EffectError(f"expected effects as 'backlash@joint1', 'cogging@*', one after the other, got {got}")
    return effects


def export(robot: AnyRobot, *, urdf: str | Path | None = None, mjcf: str | Path | None = None) -> ExportedFiles:
    """Writes a calibrated robot for other programs: as URDF, as MuJoCo model, or both (docs/export.md).

    Args:
        robot: a robot, or the result of `calibrate` or `discover`.
        urdf: where to write the robot's URDF with what was calibrated.
        mjcf: where to write the MuJoCo model.

    Returns:
        What each file holds and lacks; `answer()` says it in words.

    Raises:
        RobotError: no file is named, masses are not known, or pinocchio refuses the URDF.
        SimulationError: MuJoCo is missing, cannot build the model, or refuses it.
        JointscopeError: a file cannot be written.
    """
    return export_files(robot_of(robot), *(None if path is None else Path(path) for path in (urdf, mjcf)))


def info(bag: str | Path, robot: AnyRobot | None = None) -> BagDescription:
    """What is in a bag, and whether a robot can use it.

    Args:
        bag: a ROS 1 .bag, a ROS 2 folder, a .db3 or an .mcap.
        robot: what to compare the bag with; the bag alone if not given.

    Returns:
        The description: `text()` in words, `usable` and `problem` of the robot. What is missing is no error.

    Raises:
        RecordingError: the bag itself cannot be read.
    """
    return describe_bag(bag, None if robot is None else robot_of(robot))
