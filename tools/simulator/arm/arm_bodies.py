# SPDX-License-Identifier: BSD-3-Clause
"""What is true of an arm that is simulated: its values, and its bodies where their errors put them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.misplaced_joints import misplacement_names
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.error_parameters import error_names, is_length
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.arm.pose_effects import PoseEffect
from jointscope.tools.simulator.world.inertia import full_inertia
from jointscope.tools.simulator.world.random_streams import random_stream
from jointscope.tools.simulator.world.specification import joint_axis, link_body, quaternion_wxyz

Array = NDArray[np.float64]
LENGTH, ANGLE = 2.5e-4, 5e-4  # [m], [rad] 1 sigma of the errors that are drawn
ANYWHERE = 0.05  # [m] 1 sigma of the place on the tool of a target whose place the robot file does not give
VARIATION = 0.2  # of stiffnesses about those of the robot file, 1 sigma of the logarithm


def true_values(robot: Robot, seed: int, given: Mapping[str, float], perfect: bool = False) -> dict[str, float]:
    """Values of all parameters of an arm: the same seed is the same arm in every kind of recording.

    Args:
        robot: its file.
        seed: of the arm.
        given: values by full name, where they shall not be drawn.
        perfect: no geometric errors but those in `given`.

    Raises:
        RobotError: the robot has no such parameter.
    """
    unknown = next((name for name in given if name not in robot.parameters), None)
    if unknown:
        raise RobotError(f"robot {robot.name!r} has no parameter {unknown!r}")
    rng, values = random_stream(seed, "arm"), {}
    others = _other_targets(robot, seed, perfect)
    for name in error_names(robot.joints):
        size = (LENGTH if is_length(name) else ANGLE) * rng.standard_normal()
        values[name] = 0.0 if perfect else float(size)
    for name, parameter in robot.parameters.items():
        if name not in values and name not in others:
            drawn = parameter.prior * float(np.exp(VARIATION * rng.standard_normal()))
            values[name] = drawn if parameter.positive and not parameter.fixed else parameter.prior
    return {**values, **others, **given}


def _other_targets(robot: Robot, seed: int, perfect: bool) -> dict[str, float]:
    """Errors of further targets; one whose place nobody gives is anywhere on the tool."""
    rng, values = random_stream(seed, "targets"), {}
    for target in () if robot.poses is None else robot.poses.others:
        for name in misplacement_names([target.name]):
            size = (LENGTH if is_length(name) else ANGLE) * (0.0 if perfect else rng.standard_normal())
            values[name] = float(ANYWHERE * rng.standard_normal() if is_length(name) and target.at is None else size)
    return values


class ArmBodies:
    """Bodies of an arm.

    Args:
        robot: its tree.
        values: geometric errors by full name.
        effects: what is wrong with it.
        orientations: of targets on their links where the robot file does not give it, R_link_target, by name.
    """

    def __init__(
        self,
        robot: Robot,
        values: Mapping[str, float],
        effects: Iterable[PoseEffect],
        orientations: Mapping[str, Array] | None = None,
    ):
        self._robot, self._values, self._orientations = robot, values, orientations or {}
        self._of = {(effect.id, effect.owner): effect.parameters for effect in effects}

    def size(self, effect: str, owner: str, part: str) -> float:
        """Size of an effect; 0 where it does not act."""
        return float(self._of.get((effect, owner), {}).get(part, 0.0))

    def value(self, owner: str, part: str) -> float:
        """Value of a parameter; 0 where there is none."""
        return self._values.get(f"{owner}.{part}", 0.0)

    def compliance(self, joint: str) -> float:
        """Of a drive [rad/(N m)]; 0 of one that is rigid."""
        k = self._values.get(f"{joint}.stiffness", np.inf)
        return 1.0 / k + self.size("joint_elasticity", joint, "compliance")

    def tilt_compliance(self, joint: str, axis: str) -> float:
        """Of a bearing about x or y [rad/(N m)]; 0 of one that is rigid."""
        k = self._values.get(f"{joint}.bearing.stiffness_{axis}", np.inf)
        return 1.0 / k + self.size("bearing_flexibility", joint, f"compliance_{axis}")

    def add_to(
        self, spec: Any, angles: Mapping[str, float] | None = None, giving: Collection[str] = ()
    ) -> dict[str, tuple[Any, dict[str, Array]]]:
        """Adds the bodies to a `mujoco.MjSpec`.

        Args:
            spec: the model.
            angles: of joints that are locked; none by default.
            giving: those of them that give way, and whose hinges are at zero there; the others are welded.

        Returns:
            Of each joint that is not welded its body, and the axes of the hinges that it may have: "" of the drive,
            ".y" and ".x" of the bearing.
        """
        robot, tree, welded = self._robot, self._robot.tree, angles or {}
        parent, found, bodies = spec.worldbody, {}, dict[int, Any]()
        for j in range(1, tree.model.njoints):
            name, inertia = tree.model.names[j], tree.model.inertias[j]
            more = 1.0 + self.size("link_mass", name, "mass") / max(inertia.mass, 1e-9)  # of the same material
            place, (axis, _) = tree.model.jointPlacements[j], joint_axis(tree.model, j)
            x = np.eye(3)[1] if abs(axis[0]) > 0.9 else np.eye(3)[0]
            y = np.cross(axis, x)
            turn = pin.exp3(self.value(name, "mis_y") * y) @ pin.exp3(self.value(name, "mis_x") * x)
            turn = place.rotation @ turn @ pin.exp3((self.value(name, "offset") + welded.get(name, 0.0)) * axis)
            shift = [self.value(name, part) for part in ("lx", "ly", "lz")]
            parent = parent.add_body(
                name=link_body(name),
                pos=place.translation + shift,
                quat=quaternion_wxyz(turn),
                explicitinertial=True,
                mass=max(inertia.mass * more, 1e-9),
                ipos=inertia.lever,
                fullinertia=full_inertia(inertia.inertia * more + 1e-9 * np.eye(3)),
            )
            bodies[j] = parent
            if name not in welded or name in giving:
                found[name] = parent, {"": axis, ".y": y, ".x": x}
        if robot.poses is not None:
            self._add_targets(bodies)
        return found

    def _add_targets(self, bodies: Mapping[int, Any]) -> None:
        """A site for each target on the body behind its joint, by number of the joint; the payload at the first one."""
        setup, tree = self._robot.poses, self._robot.tree
        assert setup is not None
        places = []
        for i, target in enumerate(setup.targets):
            owner, frame = target.name if i else "tool", tree.model.frames[tree.frame_id(target.link)]
            placement, body = frame.placement, bodies[int(frame.parentJoint)]
            error = np.array([self.value(owner, part) for part in ("lx", "ly", "lz")])
            places.append(placement.act((np.zeros(3) if target.at is None else target.at) + error))
            turn = placement.rotation @ self._orientations.get(
                target.name, np.eye(3) if target.turn is None else target.turn
            )
            for part, axis in (("mis_y", [0.0, 1.0, 0.0]), ("mis_x", [1.0, 0.0, 0.0]), ("offset", [0.0, 0.0, 1.0])):
                turn = turn @ pin.exp3(self.value(owner, part) * np.array(axis))
            body.add_site(name=f"target {target.name}", pos=places[-1], quat=quaternion_wxyz(turn))
        at, mass = places[0], self.size("payload", "robot", "mass")
        if mass > 0.0:
            first = tree.model.frames[tree.frame_id(setup.link)].parentJoint
            bodies[int(first)].add_body(
                name="payload",
                pos=at,
                ipos=np.zeros(3),
                mass=mass,
                explicitinertial=True,
                inertia=[1e-6] * 3,
            )
