# SPDX-License-Identifier: BSD-3-Clause
"""Which effects of the catalogue show in equations without masses, and which columns belong to each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from jointscope.robots.model.robot import Robot

SIZES = {
    "joint_elasticity": ("compliance",),
    "encoder_delay": ("delay",),
    "gyro_delay": ("delay",),
    "encoder_eccentricity": ("cos", "sin"),
    "backlash": ("half_gap",),
    "spring_cubic": ("stiffness",),
    "motor_viscous": ("coefficient",),
}
ONE_SIDED = ("joint_elasticity", "encoder_delay", "gyro_delay", "backlash", "motor_viscous")
OF_A_SPRING = ("backlash", "spring_cubic", "motor_viscous")  # nothing of them shows while the gear is rigid


@dataclass(frozen=True)
class Candidate:
    """An effect that may be missing.

    Attributes:
        effect: id.
        owner: joint, gyro or link encoder.
        order: periods per turn of an effect that repeats with the position; the same effect at any order.
    """

    effect: str
    owner: str
    order: float = field(default=1.0, compare=False)

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return f"{self.effect}@{self.owner}"

    @property
    def sizes(self) -> tuple[str, ...]:
        """Full names of its columns."""
        return tuple(f"{self.owner}.{self.effect}.{size}" for size in SIZES[self.effect])

    @property
    def one_sided(self) -> bool:
        """Whether only sizes above zero are physical."""
        return self.effect in ONE_SIDED


def candidates(robot: Robot) -> list[Candidate]:
    """All effects that could show in a robot, those it has included."""
    encoder = robot.link_encoder
    assert encoder is not None
    measured = robot.torque_sensor is not None or robot.command.unit == "N m"
    own = ["encoder_delay", "encoder_eccentricity"]
    own += ["joint_elasticity", "backlash", "spring_cubic"] if measured else []
    own += ["motor_viscous"] if measured and robot.torque_sensor is None else []
    found = [Candidate("encoder_delay", encoder.name)]
    found += [Candidate(effect, joint) for joint in robot.joints for effect in own]
    return found + [Candidate("gyro_delay", gyro.name) for gyro in robot.gyros]


def present(robot: Robot) -> list[Candidate]:
    """The effects that a robot has."""
    found = []
    for here in robot.effects:
        if here.effect.id in SIZES:
            order = robot.parameters.get(here.parameter("order"))
            found.append(Candidate(here.effect.id, here.owner, 1.0 if order is None else order.value))
    return found


def columns_of(robot: Robot, chosen: Sequence[Candidate]) -> list[str]:
    """Names of all columns of a model: its effects, mountings of gyros, dry friction before measured springs."""
    names = [f"{gyro.name}.R_imu_body.{axis}" for gyro in robot.gyros for axis in "xyz"]
    for candidate in chosen:
        names += candidate.sizes
        friction = f"{candidate.owner}.coulomb_torque"
        if candidate.effect == "joint_elasticity" and robot.torque_sensor is None and friction in robot.parameters:
            names.append(friction)
    return names


def may_be_added(candidate: Candidate, chosen: Sequence[Candidate]) -> bool:
    """Whether an effect is not there yet and has what it needs."""
    if candidate in chosen:
        return False
    spring = Candidate("joint_elasticity", candidate.owner)
    return candidate.effect not in OF_A_SPRING or spring in chosen
