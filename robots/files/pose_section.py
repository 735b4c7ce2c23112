# SPDX-License-Identifier: BSD-3-Clause
"""The section `poses` of a robot file, and the geometric errors that come with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from jointscope.robots.bodies.misplaced_joints import LENGTHS
from jointscope.robots.errors import RobotError
from jointscope.robots.files.sensor_sections import topic_or_usual
from jointscope.robots.geometry.arm_chain import ArmChain
from jointscope.robots.geometry.error_parameters import TOOL, error_parameters
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.pose_setup import PoseSetup
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.yaml_section import Section, did_you_mean

JOINT_STATES = Topic("/joint_states", "sensor_msgs/msg/JointState", "position", "rad")
POSITIONS = Topic("/tracker/point", "geometry_msgs/msg/PointStamped", "point", "m")
TARGET_SIGMA = 1e-4  # [m] where the file says nothing
REPEATABILITY = 3e-5  # [rad]
LENGTH_SIGMA, ANGLE_SIGMA = 2e-3, 5e-3  # [m], [rad] of an arm as it leaves the factory
SIZES = ("sigma", "length_sigma", "angle_sigma", "tool_sigma")


def no_poses(robot: Robot) -> str:
    """What to say of a robot file that does not say what is measured of a pose."""
    return (
        f"{robot.path.name} has no section `poses`, which says what is measured of a pose: see docs/poses.md, or "
        "`jointscope robots tx90l` for an example"
    )


def pose_setup(section: Section, joints: tuple[str, ...]) -> PoseSetup:
    """Reads the section.

    Args:
        section: of the robot file.
        joints: of the robot.
    """
    length = section.number("length_sigma", LENGTH_SIGMA, positive=True)
    each = isinstance(section.raw("repeatability"), list | tuple)
    if each:
        repeatability = section.array("repeatability", (len(joints),))
    else:
        repeatability = np.full(len(joints), section.number("repeatability", REPEATABILITY, positive=True))
    if np.any(repeatability <= 0.0):
        raise RobotError(f"{section.place}.repeatability: expected numbers above zero [rad]")
    return PoseSetup(
        link=section.text("target"),
        at=section.array("at", (3,), np.zeros(3)),
        tracker_link=section.text("tracker", None),
        tracker=section.array("tracker_pose", (4, 4), None),
        joint_states=topic_or_usual(section, "joint_states", JOINT_STATES, joints),
        positions=topic_or_usual(section, "positions", POSITIONS, ()),
        target_sigma=section.number("sigma", TARGET_SIGMA, positive=True),
        joint_sigmas=repeatability,
        estimate_sigma=section.flag("estimate_repeatability", True),
        length_sigma=length,
        angle_sigma=section.number("angle_sigma", ANGLE_SIGMA, positive=True),
        tool_sigma=section.number("tool_sigma", length, positive=True),
        contact_distance=section.number("contact_distance", None, positive=True),
    )


def with_poses(robot: Robot, setup: PoseSetup) -> Robot:
    """The robot with what poses may tell of it: its geometric errors are parameters, at zero unless the file says more.

    Raises:
        RobotError: the target or the tracker is on no link, or a parameter is unknown or in another unit.
    """
    place = robot.path.name
    for key, link in (("target", setup.link), ("tracker", setup.tracker_link)):
        if link is not None and link not in robot.tree.bodies:
            raise RobotError(f"{place}: poses.{key}: no link {link!r}{did_you_mean(link, robot.tree.bodies)}")
    if setup.tracker_link is not None and setup.tracker is None:
        model = robot.tree.model
        frame = model.frames[robot.tree.frame_id(setup.tracker_link)]
        if frame.parentJoint:
            raise RobotError(
                f"{place}: poses.tracker: {setup.tracker_link} moves with the arm; expected a link of the base"
            )
        setup = replace(setup, tracker=np.array(frame.placement.homogeneous))
    joints = ArmChain(robot.tree, setup.link, setup.at).joints
    errors = error_parameters(joints, setup.length_sigma, setup.angle_sigma)
    for part in LENGTHS:
        errors[f"{TOOL}.{part}"] = replace(errors[f"{TOOL}.{part}"], prior_sigma=setup.tool_sigma)
    return replace(robot, poses=setup, parameters={**errors, **robot.parameters})


def write_tracker(section: Any, setup: PoseSetup) -> None:
    """Writes where the tracker was found to stand, where no link of the URDF says it, and how well the arm repeats."""
    if setup.tracker is not None and setup.tracker_link is None:
        section["tracker_pose"] = [[float(f"{v:.10g}") for v in row] for row in setup.tracker.tolist()]
    if setup.estimate_sigma:
        section["repeatability"] = [float(f"{v:.4g}") for v in setup.joint_sigmas.tolist()]
