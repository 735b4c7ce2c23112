# SPDX-License-Identifier: BSD-3-Clause
"""The section `derived` of a robot file: results in the words of a paper or a data sheet.

    derived:
      joint1.spring.a1: {unit: N/m, of: {joint1.stiffness: 16023.07}}
      gravity.beta4: {unit: N m, gravity: {joint3: 1, joint4: -1}, at: [0, 0, 0, 0]}

The first is a sum of parameters with factors, the second one of torques of gravity in a posture.
"""

from __future__ import annotations

from functools import partial

from jointscope.robots.errors import RobotError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.derived import Derived
from jointscope.robots.yaml_section import Section, did_you_mean


def derived_results(section: Section, robot: Robot) -> tuple[Derived, ...]:
    """All entries of the section.

    Raises:
        RobotError: a name that a parameter has, unknown parameters or joints, both sums or none.
    """
    return tuple(own.build(partial(_derived, name=name, robot=robot)) for name, own in section.sections())


def _derived(section: Section, name: str, robot: Robot) -> Derived:
    if name in robot.parameters:
        raise RobotError(f"{section.place}: a parameter has this name; give the result another one")
    if ("of" in section) == ("gravity" in section):
        raise RobotError(f"{section.place}: expected either of or gravity, got {', '.join(section.keys())}")
    if "of" in section:
        return Derived(name, section.text("unit"), of=_factors(section, "of", tuple(robot.parameters), "parameter"))
    factors = _factors(section, "gravity", robot.joints, "joint")
    at = section.array("at", (robot.n,))
    return Derived(name, section.text("unit"), gravity=factors, at=tuple(at.tolist()))


def _factors(section: Section, key: str, known: tuple[str, ...], what: str) -> dict[str, float]:
    own = section.section(key)
    for name in own.keys():
        if name not in known:
            raise RobotError(f"{own.place}: no {what} {name!r}{did_you_mean(name, known)}")
    return {name: own.number(name) for name in own.keys()}
