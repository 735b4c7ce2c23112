# SPDX-License-Identifier: BSD-3-Clause
"""The section `poses` of a robot file, and the geometric errors that come with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.misplaced_joints import LENGTHS
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.errors import RobotError
from jointscope.robots.files.sections.sensor_sections import topic_or_usual
from jointscope.robots.geometry.arm_chain import ArmChain
from jointscope.robots.geometry.error_parameters import TOOL, TRACKER, error_parameters
from jointscope.robots.geometry.rotations import of_quaternions, quaternion_xyzw
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.pose_setup import MountedTarget, PoseSetup
from jointscope.robots.parts.sensors import Topic
from jointscope.robots.yaml_section import Section, did_you_mean

Array = NDArray[np.float64]
JOINT_STATES = Topic("/joint_states", "sensor_msgs/msg/JointState", "position", "rad")
POSITIONS = Topic("/tracker/point", "geometry_msgs/msg/PointStamped", "point", "m")
TARGET_SIGMA = 1e-4  # [m] where the file says nothing
TURN_SIGMA = 1e-4  # [rad]
REPEATABILITY = 3e-5  # [rad]
LENGTH_SIGMA, ANGLE_SIGMA = 2e-3, 5e-3  # [m], [rad] of an arm as it leaves the factory
ANYWHERE = 0.3  # [m] prior sigma of the place of a target that the file does not give
UNIT = 1e-3  # that the norm of a quaternion may be off
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
    link, positions = section.text("target"), topic_or_usual(section, "positions", POSITIONS, ())
    return PoseSetup(
        link=link,
        at=section.array("at", (3,), np.zeros(3)),
        tracker_link=section.text("tracker", None),
        tracker=section.array("tracker_pose", (4, 4), None),
        joint_states=topic_or_usual(section, "joint_states", JOINT_STATES, joints),
        positions=positions,
        target_sigma=section.number("sigma", TARGET_SIGMA, positive=True),
        joint_sigmas=repeatability,
        estimate_sigma=section.flag("estimate_repeatability", True),
        length_sigma=length,
        angle_sigma=section.number("angle_sigma", ANGLE_SIGMA, positive=True),
        tool_sigma=section.number("tool_sigma", length, positive=True),
        contact_distance=section.number("contact_distance", None, positive=True),
        turn=_turn_of(section),
        turn_sigma=section.number("orientation_sigma", TURN_SIGMA, positive=True),
        estimate_turn_sigma=section.flag("estimate_orientation_sigma", True),
        others=_other_targets(section, link, positions, joints),
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
    _must_be_links(robot.tree, setup, place)
    try:
        joints = ArmChain(robot.tree, setup.link, setup.at, [target.link for target in setup.targets]).joints
    except RobotError as err:
        raise RobotError(f"{place}: section poses: {err}") from None
    errors = error_parameters(joints, setup.length_sigma, setup.angle_sigma, setup.other_names)
    for part in LENGTHS:
        errors[f"{TOOL}.{part}"] = replace(errors[f"{TOOL}.{part}"], prior_sigma=setup.tool_sigma)
    errors |= _placed_targets(setup, errors)
    return replace(robot, poses=setup, parameters={**errors, **robot.parameters})


def write_tracker(section: Any, setup: PoseSetup) -> None:
    """Writes where the tracker was found to stand, where no link of the URDF says it, and how well the arm repeats."""
    if setup.tracker is not None and setup.tracker_link is None:
        section["tracker_pose"] = [[float(f"{v:.10g}") for v in row] for row in setup.tracker.tolist()]
    if setup.estimate_sigma:
        section["repeatability"] = [float(f"{v:.4g}") for v in setup.joint_sigmas.tolist()]
    _write_turns(section, setup)


def _turn_of(section: Section) -> Array | None:
    """The orientation of a target in the axes of its link, R_link_target, shape (3, 3); None where none is given.

    Raises:
        RobotError: no quaternion of norm one.
    """
    xyzw = section.array("orientation", (4,), None)
    if xyzw is None:
        return None
    norm = float(np.linalg.norm(xyzw))
    if abs(norm - 1.0) > UNIT:
        raise RobotError(
            f"{section.place}.orientation: expected a quaternion [x, y, z, w] of norm one, got one of norm {norm:.4g}"
        )
    return of_quaternions(xyzw[None] / norm)[0]


def _other_targets(section: Section, link: str, positions: Topic, joints: tuple[str, ...]) -> tuple[MountedTarget, ...]:
    """Targets beside the first one.

    Args:
        section: `poses`.
        link: that carries the first target.
        positions: of the first target in a bag.
        joints: of the robot.

    Raises:
        RobotError: a name that something else has, or a key that is unknown.
    """
    if "targets" not in section:
        return ()
    found = []
    for name, entry in section.section("targets").sections():
        if name in (*joints, link, TOOL, TRACKER) or not name or "." in name:
            raise RobotError(
                f"{entry.place}: {name!r} is the name of the first target, of a joint, {TOOL}, {TRACKER} or has a dot; "
                "give the target a name of its own"
            )
        found.append(entry.build(partial(_other_target, name=name, link=link, positions=positions)))
    return tuple(found)


def _other_target(section: Section, name: str, link: str, positions: Topic) -> MountedTarget:
    own = replace(positions, topic=f"/tracker/{name}")
    return MountedTarget(
        name,
        section.text("link", link),
        section.array("at", (3,), None),
        _turn_of(section),
        topic_or_usual(section, "positions", own, ()),
    )


def _must_be_links(tree: RigidTree, setup: PoseSetup, place: str) -> None:
    """Further targets on links of the URDF.

    Raises:
        RobotError: one that is on none.
    """
    for target in setup.others:
        if target.link not in tree.bodies:
            where = f"{place}: poses.targets.{target.name}.link"
            raise RobotError(f"{where}: no link {target.link!r}{did_you_mean(target.link, tree.bodies)}")


def _placed_targets(setup: PoseSetup, errors: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Errors of further targets whose place is not given, which may be anywhere."""
    names = [f"{target.name}.{part}" for target in setup.others if target.at is None for part in LENGTHS]
    return {name: replace(errors[name], prior_sigma=ANYWHERE) for name in names}


def _write_turns(section: Any, setup: PoseSetup) -> None:
    """Writes how targets were found to be oriented, where the file does not say it, and the noise of orientations."""
    for entry, target in zip(
        (section, *(section["targets"][name] for name in setup.other_names)), setup.targets, strict=True
    ):
        if target.turn is not None and "orientation" not in entry:
            entry["orientation"] = [float(f"{v:.10g}") for v in quaternion_xyzw(target.turn).tolist()]
    if setup.estimate_turn_sigma and any(target.turn is not None for target in setup.targets):
        section["orientation_sigma"] = float(f"{setup.turn_sigma:.4g}")
