# SPDX-License-Identifier: BSD-3-Clause
"""What is true of an arm that is simulated: its values, and its bodies where their errors put them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.error_parameters import error_names, is_length
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.arm.pose_effects import PoseEffect
from jointscope.tools.simulator.world.inertia import full_inertia
from jointscope.tools.simulator.world.random_streams import random_stream
from jointscope.tools.simulator.world.specification import joint_axis, link_body, quaternion_wxyz

Array = NDArray[np.float64]
LENGTH, ANGLE = 2.5e-4, 5e-4  # [m], [rad] 1 sigma of the errors that are drawn
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
    for name in error_names(robot.joints):
        size = (LENGTH if is_length(name) else ANGLE) * rng.standard_normal()
        values[name] = 0.0 if perfect else float(size)
    for name, parameter in robot.parameters.items():
        if name not in values:
            drawn = parameter.prior * float(np.exp(VARIATION * rng.standard_normal()))
            values[name] = drawn if parameter.positive and not parameter.fixed else parameter.prior
    return {**values, **given}


class ArmBodies:
    """Bodies of an arm.

    Args:
        robot: its tree.
        values: geometric errors by full name.
        effects: what is wrong with it.
    """

    def __init__(self, robot: Robot, values: Mapping[str, float], effects: Iterable[PoseEffect]):
        self._robot, self._values = robot, values
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
        parent, found = spec.worldbody, {}
        for j in range(1, tree.model.njoints):
            name, inertia = tree.model.names[j], tree.model.inertias[j]
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
                mass=max(inertia.mass + self.size("link_mass", name, "mass"), 1e-9),
                ipos=inertia.lever,
                fullinertia=full_inertia(inertia.inertia + 1e-9 * np.eye(3)),
            )
            if name not in welded or name in giving:
                found[name] = parent, {"": axis, ".y": y, ".x": x}
        if robot.poses is not None:
            self._add_target(spec, parent)
        return found

    def _add_target(self, spec: Any, body: Any) -> None:
        setup, tree = self._robot.poses, self._robot.tree
        assert setup is not None
        placement = tree.model.frames[tree.frame_id(setup.link)].placement
        error = [self.value("tool", part) for part in ("lx", "ly", "lz")]
        at = placement.act(setup.at + np.array(error))
        body.add_site(name="target", pos=at)
        mass = self.size("payload", "robot", "mass")
        if mass > 0.0:
            body.add_body(
                name="payload",
                pos=at,
                ipos=np.zeros(3),
                mass=mass,
                explicitinertial=True,
                inertia=[1e-6] * 3,
            )
