# SPDX-License-Identifier: BSD-3-Clause
"""An arm with one more effect, at sizes that were seen or at the null value, where it does nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from jointscope.robots.geometry.arm_effects import ArmHypothesis
from jointscope.robots.geometry.error_parameters import BEARING, DAMPING, RIPPLE, STIFFNESS, TILT_DAMPING
from jointscope.robots.geometry.flexible_arm import LOSS
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter

DAMPER = {STIFFNESS: DAMPING, **dict(zip(BEARING, TILT_DAMPING, strict=True))}  # of each spring
ORDER_SIGMA = 0.3  # of the waves per turn, about the best whole number
RIGID = 1e12  # [N m/rad] start of a stiffness whose compliance is looked for


def at_null(robot: Robot, effects: Sequence[ArmHypothesis]) -> Robot:
    """The robot with effects that do nothing; what is soft is as good as rigid."""
    for hypothesis in effects:
        null = RIGID if hypothesis.kind.soft else 0.0
        robot = with_effect(robot, hypothesis, dict.fromkeys(hypothesis.names, null))
    return robot


def with_effect(robot: Robot, hypothesis: ArmHypothesis, values: Mapping[str, float]) -> Robot:
    """The robot with an effect whose sizes begin at some values."""
    kind, parameters = hypothesis.kind, dict(robot.parameters)
    for name in hypothesis.names:
        value = values[name]
        prior, sigma = (value, 1.1 * value) if kind.soft else (0.0, kind.size)
        parameters[name] = Parameter(name, value, kind.unit, prior, sigma, positive=kind.soft, effect=kind.id)
        if kind.soft and robot.frequency is not None:
            damper = f"{hypothesis.owner}.{DAMPER[name.removeprefix(f'{hypothesis.owner}.')]}"
            loss = LOSS * value
            parameters.setdefault(damper, Parameter(damper, loss, "N m s/rad", loss, 1.1 * loss, effect=kind.id))
    if kind.orders:
        name, order = f"{hypothesis.owner}.{RIPPLE[2]}", float(hypothesis.order or kind.orders[0])
        parameters[name] = Parameter(name, order, "1", order, ORDER_SIGMA, positive=False, effect=kind.id)
    return replace(robot, parameters=parameters)
