# SPDX-License-Identifier: BSD-3-Clause
"""Efforts that were measured beside positions: torques behind springs, or what motors report of themselves."""

from __future__ import annotations

from jointscope.tools.init.streams.named_signal import Chosen, NamedSignal, Wish, named_signal
from jointscope.tools.init.streams.signals import Signal


def torque_behind(
    signals: list[Signal],
    link_side: list[NamedSignal],
    urdf_joints: tuple[str, ...],
    wish: Wish,
    joints: tuple[str, ...],
) -> Chosen | None:
    """Torques that are measured behind the motors."""
    topics = [n.signal.topic for n in link_side]
    for signal in signals:
        if signal.quantity == "effort" and signal.topic in topics:
            named = named_signal(signal, urdf_joints, wish)
            if all(named.varies(joint) for joint in joints):
                return named.chosen(joints, "efforts beside the positions of the links", False)
    return None


def effort_beside(
    signals: list[Signal],
    motors: NamedSignal,
    drive: NamedSignal,
    urdf_joints: tuple[str, ...],
    wish: Wish,
    joints: tuple[str, ...],
) -> Chosen | None:
    """Efforts in the messages with the positions of the motors, where something else drives them."""
    if drive.signal.topic == motors.signal.topic:
        return None
    for signal in signals:
        if signal.quantity == "effort" and signal.topic == motors.signal.topic and not signal.commanded:
            named = named_signal(signal, urdf_joints, wish) if signal.names else NamedSignal(signal, motors.names)
            if all(named.varies(joint) for joint in joints):
                return named.chosen(joints, "efforts beside the positions of the motors", False)
    return None
