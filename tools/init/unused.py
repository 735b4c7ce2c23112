# SPDX-License-Identifier: BSD-3-Clause
"""What a bag also holds and a guessed robot does not use, with the reason."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.tools.bags.messages.joined_topics import parts_of
from jointscope.tools.init.estimates.measured_currents import VOLTAGES, GuessedCurrents
from jointscope.tools.init.streams.roles import Roles
from jointscope.tools.init.streams.signals import Signal


def unused(
    signals: Sequence[Signal], roles: Roles, masses: bool, currents: GuessedCurrents | None, unit: str
) -> list[str]:
    """A sentence for each.

    Args:
        signals: of the bag.
        roles: those that were chosen.
        masses: whether the URDF has them.
        currents: efforts that are a sensor; None where they are not.
        unit: of the command.
    """
    chosen = [roles.command, roles.motor_encoder, *([roles.link_encoder] if roles.link_encoder else [])]
    whole = [*(role.signal.topic for role in chosen), *(s.topic for s in roles.imus)]
    used = {*whole, *(part for topic in whole for part in parts_of(topic))}
    said = [f"{topic}: no role found for it" for topic in dict.fromkeys(s.topic for s in signals) if topic not in used]
    if roles.joint_torque is not None and masses:
        topic = roles.joint_torque.signal.topic
        said.append(f"{topic}, effort: torques of joints are measured at springs, and joints are rigid here")
    if roles.motor_effort is not None and masses and currents is None:
        topic = roles.motor_effort.signal.topic
        why = "a command in volts would show whether it is a current"
        if unit in VOLTAGES:
            why = "commands and speeds do not explain it as currents of the same joints, in the same order"
        said.append(f"{topic}, effort: what the motors report; {why}")
    return said
