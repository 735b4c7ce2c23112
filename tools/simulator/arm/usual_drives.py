# SPDX-License-Identifier: BSD-3-Clause
"""Drives of an arm whose robot file knows poses only, so that it can be shaken: what the file does not say is made up.

A rotor is about as heavy, seen through its gear, as what it moves (a gear that accelerates its load fastest), and a
spring with a rotor on each side is damped to some per cent, as the drives of the TX90L are (0.3 to 0.8 ms).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointscope.robots.errors import SimulationError
from jointscope.robots.files.sections.frequency_section import INERTIA, POSITIONS, TORQUES
from jointscope.robots.geometry.error_parameters import BEARING, DAMPING, STIFFNESS, TILT_DAMPING
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.frequency_setup import FrequencySetup
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import Topic

DAMPING_TIME = 6e-4  # [s] damping over stiffness of drives and bearings
ROTOR_SHARE = 0.5  # of what a motor moves, in the middle of the joints' ranges


def with_usual_drives(robot: Robot) -> tuple[Robot, str]:
    """The robot with all that it takes to shake it, and what to say of what was made up; itself where nothing was.

    Raises:
        SimulationError: the robot file knows no spring.
    """
    if robot.frequency is not None:
        return robot, ""
    joints = tuple(joint for joint in robot.joints if f"{joint}.{STIFFNESS}" in robot.parameters)
    if not joints:
        raise SimulationError(
            f"{robot.path.name} has neither `command` and `sensors` nor a drive with a stiffness; add "
            f"`{robot.joints[0]}.stiffness: {{value: ..., unit: N m/rad, prior_sigma: ...}}` to its parameters"
        )
    limits = np.nan_to_num(robot.tree.limits, posinf=np.pi, neginf=-np.pi)
    moved = np.diagonal(robot.tree.mass_matrix(limits.mean(axis=1)[None])[0])
    made = {f"{joint}.{INERTIA}": (ROTOR_SHARE * moved[robot.joints.index(joint)], "kg m2") for joint in joints}
    springs = dict(zip((STIFFNESS, *BEARING), (DAMPING, *TILT_DAMPING), strict=True))
    for joint in joints:
        for spring, damper in springs.items():
            if f"{joint}.{spring}" in robot.parameters:
                made[f"{joint}.{damper}"] = DAMPING_TIME * robot.parameter(f"{joint}.{spring}").prior, "N m s/rad"
    new = {name: value for name, value in made.items() if name not in robot.parameters}
    added = {
        name: Parameter(name, value, unit, value, 0.5 * value, fixed=name.endswith(INERTIA))
        for name, (value, unit) in new.items()
    }
    setup = FrequencySetup(joints, _named(TORQUES, robot), _named(POSITIONS, robot))
    shaken = replace(robot, frequency=setup, parameters={**robot.parameters, **added})
    first = f"{joints[0]}.{INERTIA}"
    said = (
        f"\n  {robot.path.name} does not say how heavy rotors are and how strong dampers: they are made up, and stand "
        f"in the truth; --set {first}={shaken.parameter(first).value:.3g} sets one"
        "\n  `calibrate --frequency` needs them and a section `frequency` in the robot file, as `jointscope robots "
        "tx90l` has"
    )
    return shaken, said


def _named(topic: Topic, robot: Robot) -> Topic:
    return replace(topic, names=robot.joints)
