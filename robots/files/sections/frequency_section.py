# SPDX-License-Identifier: BSD-3-Clause
"""The section `frequency` of a robot file, and the parameters that frequency responses tell."""

from __future__ import annotations

from collections.abc import Mapping

from jointscope.robots.errors import RobotError
from jointscope.robots.files.sections.sensor_sections import topic_or_usual
from jointscope.robots.geometry.arm_effects import effect_units
from jointscope.robots.geometry.error_parameters import BEARING, DAMPING, STIFFNESS, TILT_DAMPING, VISCOUS, pose_units
from jointscope.robots.model.robot import SHARPNESS, Robot
from jointscope.robots.parts.frequency_setup import FrequencySetup
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.yaml_section import Section, did_you_mean

TORQUES = Topic("/joint_states", "sensor_msgs/msg/JointState", "effort", "N m")
POSITIONS = Topic("/joint_states", "sensor_msgs/msg/JointState", "position", "rad")
INERTIA, COULOMB = "inertia", "coulomb_torque"
NEEDED = (STIFFNESS, DAMPING, INERTIA)


def no_frequency(robot: Robot) -> str:
    """What to say of a robot file that does not say what is shaken."""
    return (
        f"{robot.path.name} has no section `frequency`, which says what is shaken: see docs/frequency.md, or "
        "`jointscope robots tx90l` for an example"
    )


def frequency_setup(section: Section, joints: tuple[str, ...]) -> FrequencySetup:
    """Reads the section.

    Args:
        section: of the robot file.
        joints: of the robot.
    """
    shaken = section.texts("joints", joints)
    strange = next((name for name in shaken if name not in joints), None)
    if strange is not None or not shaken:
        raise RobotError(f"{section.place}.joints: {strange!r} is no joint{did_you_mean(str(strange), joints)}")
    return FrequencySetup(
        shaken,
        topic_or_usual(section, "torques", TORQUES, joints),
        topic_or_usual(section, "positions", POSITIONS, joints),
    )


def frequency_units(joints: tuple[str, ...]) -> dict[str, str]:
    """Units of all parameters that frequency responses may tell, by name."""
    parts = dict.fromkeys((STIFFNESS, *BEARING), "N m/rad") | dict.fromkeys((DAMPING, *TILT_DAMPING), "N m s/rad")
    parts |= {INERTIA: "kg m2", COULOMB: "N m", VISCOUS: "N m s/rad", SHARPNESS: "s/rad"}
    return {f"{joint}.{part}": unit for joint in joints for part, unit in parts.items()}


def check_frequency(robot: Robot) -> None:
    """Complains where a motor that is shaken lacks what its equation needs.

    Raises:
        RobotError: a parameter is missing.
    """
    for joint in robot.frequency.joints if robot.frequency is not None else ():
        missing = next((name for name in (f"{joint}.{part}" for part in NEEDED) if name not in robot.parameters), None)
        if missing is not None:
            raise RobotError(f"{robot.path.name}: parameters: {missing!r} is missing, which `frequency` needs")


def check_still_parameters(robot: Robot, parameters: Mapping[str, Parameter]) -> None:
    """Complains about parameters of a robot without motion that are none.

    Raises:
        RobotError: unknown, or in another unit.
    """
    place, units = robot.path.name, {} if robot.frequency is None else frequency_units(robot.joints)
    if robot.poses is not None:
        units |= pose_units(robot.joints, robot.poses.other_names) | effect_units(robot.joints)
    for name, parameter in parameters.items():
        if name not in units:
            raise RobotError(f"{place}: parameters: unknown parameter {name!r}{did_you_mean(name, list(units))}")
        if parameter.unit != units[name]:
            raise RobotError(f"{place}: parameters.{name}.unit: expected {units[name]!r}, got {parameter.unit!r}")
    check_frequency(robot)
