# SPDX-License-Identifier: BSD-3-Clause
"""Which effects of the catalogue show in equations without masses, and which columns belong to each."""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.graphs.transmission.equation import ELASTICITY, RIPPLE
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.robot import Robot

SPRING = "joint_elasticity"
SIZES = {
    SPRING: ("compliance",),
    "encoder_delay": ("delay",),
    "gyro_delay": ("delay",),
    RIPPLE: ("cos", "sin"),
    "backlash": ("half_gap",),
    "spring_cubic": ("stiffness",),
    "motor_viscous": ("coefficient",),
}
ONE_SIDED = (SPRING, "encoder_delay", "gyro_delay", "backlash", "motor_viscous")
OF_A_SPRING = ("backlash", "spring_cubic", "motor_viscous")  # nothing of them shows while the gear is rigid


@dataclass(frozen=True)
class Hypothesis:
    """An effect that may be missing.

    Attributes:
        effect: id.
        owner: joint, gyro or link encoder.
        order: periods per turn of an effect that repeats with the position.
        friction: whether dry friction, in the model already, shows with it: nothing sees it before a spring.
    """

    effect: str
    owner: str
    order: float = 1.0
    friction: bool = False

    @property
    def label(self) -> str:
        """ID@OWNER."""
        return f"{self.effect}@{self.owner}"

    @property
    def sizes(self) -> tuple[str, ...]:
        """Full names of its parameters that have a null value."""
        return tuple(f"{self.owner}.{self.effect}.{size}" for size in SIZES[self.effect])

    @property
    def mark(self) -> str:
        """How names of columns end that stand beside those of order one."""
        return "" if self.order == 1.0 else f"@{self.order:g}"

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of its columns, those of its own sizes first."""
        own = tuple(name + self.mark for name in self.sizes)
        return (*own, f"{self.owner}.coulomb_torque") if self.friction else own

    @property
    def one_sided(self) -> bool:
        """Whether only sizes above zero are physical."""
        return self.effect in ONE_SIDED

    def added_to(self, robot: Robot, values: dict[str, float], friction: float) -> Robot:
        """The robot with this effect.

        Args:
            robot: without it.
            values: of its sizes, by the last part of their names.
            friction: dry friction that shows with it [N m].
        """
        values = values | ({"order": self.order} if self.effect == RIPPLE else {})
        robot = add_effect(robot, self.label, values)
        return robot.with_values({f"{self.owner}.coulomb_torque": max(friction, 1e-9)}) if self.friction else robot


def hypotheses(robot: Robot) -> list[Hypothesis]:
    """All effects that a robot may lack."""
    encoder = robot.link_encoder
    assert encoder is not None
    measured = robot.torque_sensor is not None or robot.command.unit == "N m"
    own = ["encoder_delay", RIPPLE]
    own += [SPRING, "backlash", "spring_cubic"] if measured else []
    own += ["motor_viscous"] if measured and robot.torque_sensor is None else []
    found = [Hypothesis("encoder_delay", encoder.name)]
    for joint in robot.joints:
        dry = robot.torque_sensor is None and f"{joint}.coulomb_torque" in robot.parameters
        found += [Hypothesis(effect, joint, friction=dry and effect == SPRING) for effect in own]
    found += [Hypothesis("gyro_delay", gyro.name) for gyro in robot.gyros]
    return [h for h in found if not robot.has_effect(h.effect, h.owner)]


def may_be_added(h: Hypothesis, robot: Robot) -> bool:
    """Whether an effect has what it needs."""
    return h.effect not in OF_A_SPRING or f"{h.owner}.{ELASTICITY}" in robot.parameters
