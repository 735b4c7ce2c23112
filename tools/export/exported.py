# SPDX-License-Identifier: BSD-3-Clause
"""What an export gives: the file's text, what of the calibration is in it, and what is not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.effect_kinds.groups import group_of
from jointscope.robots.errors import RobotError
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot

BY_CHANCE = 3.0  # [sigma] below zero that noise explains


@dataclass(frozen=True)
class Exported:
    """A model in a format of other programs.

    Attributes:
        text: of the file.
        holds: what of the calibration is in it, phrases.
        lacks: what is not, by name, each with the reason and what to do.
        warnings: what programs that read the file may stumble over, sentences.
    """

    text: str
    holds: tuple[str, ...]
    lacks: dict[str, str]
    warnings: tuple[str, ...] = ()

    def to_json(self) -> dict[str, object]:
        """The same for machines, without the text."""
        return {"holds": list(self.holds), "lacks": self.lacks, "warnings": list(self.warnings)}


def need_masses(robot: Robot) -> None:
    """What no format can do without.

    Raises:
        RobotError: links are free, so that their masses are not known, or the file describes no motion.
    """
    if robot.free_links:
        raise RobotError(
            f"{robot.name} has link_dynamics: free, so its masses are not known, and a URDF or MuJoCo model of motion "
            f"needs them; what was calibrated (springs, delays, zeros) is in {robot.path.name}"
        )
    robot.need_link_dynamics()


def why_not(effect: Effect, otherwise: str) -> str:
    """Why an effect has no place in a file of bodies and springs.

    Args:
        effect: the effect.
        otherwise: what to say of one of the mechanics.
    """
    if isinstance(effect, CommandEffect):
        return "acts on the command before the drive; your program applies it"
    if group_of(effect) == "sensors":
        return "an error of a sensor; sensors of the file read what is there"
    if group_of(effect) == "numerics":
        return "belongs to the steps of the calibration, not to the robot"
    return otherwise


def of_drives(robot: Robot, name: str) -> str:
    """A parameter of the drives: "2.428 kg m2" where all share it, else joint by joint."""
    found = {joint: robot.drive_parameter(joint, name) for joint in robot.joints}
    shared = {parameter.name for parameter in found.values()} == {f"motor.{name}"}
    named = {"each": robot.parameter(f"motor.{name}")} if shared else found
    return ", ".join(f"{owner} {parameter.value:.6g} {parameter.unit}" for owner, parameter in named.items())


def without_noise_below_zero(robot: Robot, names: Iterable[str]) -> tuple[Robot, tuple[str, ...]]:
    """The robot with zeros for values that noise has taken below zero where a format allows none, and a sentence on it.

    Args:
        robot: as calibrated.
        names: of parameters that may not be negative.

    Raises:
        RobotError: one that is below zero beyond noise, with what to type.
    """
    below = [robot.parameters[name] for name in names if robot.parameters[name].value < 0.0]
    for found in below:
        if found.sigma is None or found.value < -BY_CHANCE * found.sigma:
            owner, effect = found.name.split(".")[:2]
            without = edited_argument(robot, "positive")
            remove = f"jointscope remove {robot_argument(robot)} {effect}@{owner} -o {without}"
            raise RobotError(
                f"{found.name} is {found.value:g} {found.unit}, and no format allows it below zero: take it away with "
                f"`{remove}`, calibrate, and export again"
            )
    zeros = [found.name for found in below]
    said = (f"{', '.join(zeros)}: below zero by noise, 0 in the file",) if zeros else ()
    return robot.with_values(dict.fromkeys(zeros, 0.0)), said
