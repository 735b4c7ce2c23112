# SPDX-License-Identifier: BSD-3-Clause
"""Names of the components of a state: "joint1.q_link", "joint1.v_motor", "joint1.bearing_x.q_link", memories."""

from __future__ import annotations

from jointscope.robots.effect_kinds.effect import LINK_SIDE
from jointscope.robots.effect_kinds.lagging_reading import LaggingReading
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.state_layout import StateLayout


def state_names(layout: StateLayout) -> tuple[str, ...]:
    """One name per component, in the order of the layout."""
    return (
        *(f"{name}.q_link" for name in layout.links),
        *(f"{name}.v_link" for name in layout.links),
        *(f"{name}.q_motor" for name in layout.motors),
        *(f"{name}.v_motor" for name in layout.motors),
        *(f"{name}.memory" for name in layout.memories),
    )


def state_unit(robot: Robot, name: str) -> str:
    """SI unit of a component; of memories of effects only lags of encoders have one that is told."""
    owner, quantity = name.rsplit(".", 1)
    for here in robot.effects:
        if quantity == "memory" and here.label == owner and isinstance(here.effect, LaggingReading):
            return robot.unit_at(here.owner.removesuffix(LINK_SIDE), "rad")
    turning = {"q_link": "rad", "q_motor": "rad", "v_link": "rad/s", "v_motor": "rad/s"}.get(quantity, "")
    return robot.unit_at(owner, turning)
