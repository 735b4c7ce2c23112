# SPDX-License-Identifier: BSD-3-Clause
"""The rigid bodies as the model has them now: soft bearings inserted, inertias, geometry, Coriolis terms as parameters.

Accelerations are M^-1 (tau - s c - g) with the scale s of the Coriolis terms; they are linear in s, and M is linear in
every inertia parameter, so the derivatives by s follow from differences that are exact, and those by an inertia from
the torque of a body that has nothing else. Derivatives by errors of the geometry are differences of torques.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.misplaced_joints import misplace, misplacement_names
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.bodies.turned_gravity import turned_gravity
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect, about_origin
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.model.displaced_bodies import DisplacedBodies
from jointscope.robots.model.turned_axes import TurnedAxis, across_axes

if TYPE_CHECKING:
    from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
ENTRIES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # of an inertia in pinocchio's dynamic parameters


@dataclass(frozen=True)
class InertiaChange:
    """How one parameter changes one body.

    Attributes:
        name: full name of the parameter.
        joint: index of the joint in pinocchio's model.
        direction: change of the ten dynamic parameters per unit of the parameter, shape (10,).
        offset: value of the parameter at which nothing changes.
    """

    name: str
    joint: int
    direction: Array
    offset: float = 0.0


class StructuredTree:
    """Accelerations of a robot's link coordinates for given parameter values.

    Args:
        robot: the robot.

    Attributes:
        kinematics: the bodies with the inertias of the URDF.
        coriolis_scale: name of the parameter that scales the Coriolis terms; None where they are all there, or none.
    """

    def __init__(self, robot: Robot):
        self.kinematics: RigidTree = robot.kinematic_tree
        self._changes = inertia_changes(robot, self.kinematics.model)
        # name of the rotor's inertia, its row among the links, its coordinate in the model
        self._armature = [
            (
                robot.drive_parameter(joint, "inertia").name,
                int(robot.layout.joint_link[i]),
                self.kinematics.coordinate(joint),
            )
            for i, joint in enumerate(robot.joints)
            if joint not in robot.layout.motors
        ]
        self.coriolis_scale = next((e.parameter("scale") for e in robot.effects if _form(e.effect) == "coriolis"), None)
        tilted = [e for e in robot.effects if _form(e.effect) == "gravity"]
        self._tilt = tuple(e.parameter(p.name) for e in tilted for p in e.effect.parameters)
        turned = [e for e in robot.effects if _form(e.effect) == "axis"]
        self._turned = [TurnedAxis.of(e, self.kinematics.model) for e in turned]
        self._misplaced = [name for name in misplacement_names(robot.joints) if name in robot.parameters]
        of_bodies = [each.name for each in self._changes] + [name for name, *_ in self._armature]
        self._geometry = [*(name for axis in self._turned for name in axis.names), *self._misplaced]
        self._own = (*of_bodies, *self._tilt, *self._geometry)
        self._cache: tuple[tuple[float, ...], RigidTree] | None = None
        self._displaced = DisplacedBodies(self._geometry, self._own, self._with_values)

    @property
    def varies(self) -> bool:
        """Whether any parameter changes the tree."""
        return bool(self._own or self.coriolis_scale)

    def acceleration(self, q: Array, v: Array, tau: Array, values: Mapping[str, float]) -> Array:
        """Accelerations, shape (m, n_link) [rad/s^2]; arguments as those of `RigidTree.acceleration`."""
        tree = self.bodies(values)
        if self.coriolis_scale is None:
            return tree.acceleration(q, v, tau)
        s = values[self.coriolis_scale]
        still = tree.acceleration(q, np.zeros_like(v), tau)
        return still if s == 0.0 else still + s * (tree.acceleration(q, v, tau) - still)

    def acceleration_derivatives(
        self, q: Array, v: Array, tau: Array, values: Mapping[str, float]
    ) -> tuple[Array, Array, Array, Array]:
        """As `RigidTree.acceleration_derivatives`."""
        tree = self.bodies(values)
        if self.coriolis_scale is None:
            return tree.acceleration_derivatives(q, v, tau)
        s = values[self.coriolis_scale]
        moving = tree.acceleration_derivatives(q, v, tau)
        still = tree.acceleration_derivatives(q, np.zeros_like(v), tau)
        a, da_dq = (still[i] + s * (moving[i] - still[i]) for i in (0, 1))
        return a, da_dq, s * moving[2], moving[3]

    def by_parameter(
        self, q: Array, v: Array, tau: Array, a: Array, M_inverse: Array, values: Mapping[str, float]
    ) -> dict[str, Array]:
        """Derivatives of the accelerations by parameters of the tree, by name, shape (m, n_link) each."""
        tree = self.bodies(values)
        found: dict[str, Array] = {}
        scale = 1.0 if self.coriolis_scale is None else values[self.coriolis_scale]
        for name, torque in self._torques_of(self._changes, tree, q, v, a, scale):
            found[name] = -np.einsum("kij,kj->ki", M_inverse, torque)
        for name, link, _ in self._armature:
            found[name] = found.get(name, 0.0) - M_inverse[:, :, link] * a[:, link, None]
        if self._tilt:
            torques = tilt_torques(self.kinematics, tree, q, np.array([values[name] for name in self._tilt]))
            for name, torque in zip(self._tilt, torques, strict=True):
                found[name] = -np.einsum("kij,kj->ki", M_inverse, torque)
        for name, torque in self._displaced.torques(tree, (q, v, a), scale, values):
            found[name] = -np.einsum("kij,kj->ki", M_inverse, torque)
        if self.coriolis_scale is not None:
            found[self.coriolis_scale] = tree.acceleration(q, v, tau) - tree.acceleration(q, np.zeros_like(v), tau)
        return found

    def gravity_by_parameter(self, q: Array, values: Mapping[str, float]) -> dict[str, Array]:
        """Derivatives of the torques of gravity by masses and its own direction, by name, shape (m, n_link) each."""
        tree, still = self.bodies(values), np.zeros_like(q)
        heavier = [change for change in self._changes if np.any(change.direction[:4])]
        found = dict(self._torques_of(heavier, tree, q, still, still, 0.0))
        if self._tilt:
            torques = tilt_torques(self.kinematics, tree, q, np.array([values[name] for name in self._tilt]))
            found |= dict(zip(self._tilt, torques, strict=True))
        return found | dict(self._displaced.torques(tree, (q, still, still), 0.0, values))

    @staticmethod
    def _torques_of(
        changes: Sequence[InertiaChange], tree: RigidTree, q: Array, v: Array, a: Array, coriolis: float
    ) -> Iterator[tuple[str, Array]]:
        torques = inertia_torques(tree, changes, q, v, a, coriolis) if changes else ()
        return zip((change.name for change in changes), torques, strict=True)

    def bodies(self, values: Mapping[str, float]) -> RigidTree:
        """The bodies at these values."""
        if not self._own:
            return self.kinematics
        key = tuple(values[name] for name in self._own)
        known = self._cache  # another thread may put other bodies there
        if known is None or known[0] != key:
            known = self._cache = (key, self._with_values(values))
        return known[1]

    def _with_values(self, values: Mapping[str, float]) -> RigidTree:
        model = self.kinematics.model.copy()
        misplace(model, {name: values[name] for name in self._misplaced})
        for change in self._changes:
            _change(model, change, values[change.name] - change.offset)
        armature = np.array(model.armature)
        for name, _, coordinate in self._armature:
            armature[coordinate] = values[name]
        model.armature = armature
        if self._tilt:
            tilt = np.array([values[name] for name in self._tilt])
            model.gravity = pin.Motion(turned_gravity(self.kinematics.gravity, tilt)[0], np.zeros(3))
        for axis in self._turned:
            axis.turned(model, np.array([values[name] for name in axis.names]))
        return self.kinematics.with_model(model)


def inertia_torques(
    tree: RigidTree, changes: Sequence[InertiaChange], q: Array, v: Array, a: Array, coriolis: float
) -> Array:
    """Torques that a unit of each parameter asks for at given motion, shape (c, m, n_link) [N m].

    Args:
        tree: the bodies; the torques are the same whatever these weigh.
        changes: what the parameters change.
        q: positions, shape (m, n_link) [rad], as v and a.
        v: velocities.
        a: accelerations.
        coriolis: share of the Coriolis terms, where the tree has them.
    """
    joints, directions = [change.joint for change in changes], np.array([change.direction for change in changes])

    def more(velocity: Array) -> Array:
        return tree.equations.body_torques(joints, directions, q, velocity, a)

    share = coriolis if tree.coriolis else 0.0
    if share == 1.0:
        return more(v)
    still = more(np.zeros_like(v))
    return still if share == 0.0 else still + share * (more(v) - still)  # linear in the share, beyond 0 and 1, too


def tilt_torques(kinematics: RigidTree, bodies: RigidTree, q: Array, angles: Array) -> list[Array]:
    """Torque that a unit of each tilt of gravity asks for, shape (m, n_link) each [N m/rad].

    Args:
        kinematics: with gravity as the model has it.
        bodies: with their inertias.
        q: positions, shape (m, n_link) [rad].
        angles: present tilts, shape (2,) [rad].
    """
    still, found = np.zeros_like(q), []
    for slope in turned_gravity(kinematics.gravity, angles)[1]:
        model = bodies.model.copy()
        model.gravity = pin.Motion(slope, np.zeros(3))
        found.append(bodies.with_model(model).torque(q, still, still))
    return found


def inertia_changes(robot: Robot, model: pin.Model) -> list[InertiaChange]:
    """All parameters of the robot's effects that change a body."""
    found = []
    for here in robot.effects:
        joint = model.getJointId(here.owner) if model.existJointName(here.owner) else 0
        if isinstance(here.effect, InertiaEffect):
            joint = model.getJointId(here.effect.joint_of(robot, here.owner))
            present = model.inertias[joint].toDynamicParameters()
            for name, direction in here.effect.change_at(robot, here.owner, present).items():
                found.append(InertiaChange(here.parameter(name), joint, np.asarray(direction, float)))
        elif _form(here.effect) == "bearing":
            present = inertia_about_joint(model, joint)
            for name, (i, k) in hidden_inertias(model, joint).items():
                direction = np.zeros(10)
                direction[4 + ENTRIES.index((min(i, k), max(i, k)))] = 1.0
                found.append(InertiaChange(here.parameter(name), joint, direction, float(present[i, k])))
    return found


def hidden_inertias(model: pin.Model, joint: int) -> dict[str, tuple[int, int]]:
    """Entries of a body's inertia that turning about its joint alone never shows, by the parameter that holds them.

    x and y are the coordinate axes of the joint's frame across its axis, z is the third one.
    """
    x, y = across_axes(model, joint)
    z = 3 - x - y
    return {"inertia_x": (x, x), "inertia_y": (y, y), "product_xy": (x, y), "product_xz": (x, z), "product_yz": (y, z)}


def inertia_about_joint(model: pin.Model, joint: int) -> Array:
    """Inertia of the body that a joint moves, about the origin of its joint frame, shape (3, 3) [kg m2]."""
    return about_origin(model.inertias[joint].toDynamicParameters())


def bearing_names(joint: str) -> tuple[str, str]:
    """Names of the two hinges of a soft bearing."""
    return f"{joint}.bearing_x", f"{joint}.bearing_y"


def with_bearings(model: pin.Model, joints: tuple[str, ...]) -> pin.Model:
    """The model with two hinges, across the axis, before each of the joints."""
    hinges = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
    new = pin.Model()
    new.name, new.gravity = model.name, model.gravity
    ids = {0: 0}
    for j in range(1, model.njoints):
        name, parent, placement = model.names[j], ids[model.parents[j]], model.jointPlacements[j]
        if name in joints:
            for hinge, k in zip(bearing_names(name), across_axes(model, j), strict=True):
                parent = new.addJoint(parent, hinges[k](), placement, hinge)
                placement = pin.SE3.Identity()
        ids[j] = new.addJoint(parent, model.joints[j], placement, name)
        new.appendBodyToJoint(ids[j], model.inertias[j], pin.SE3.Identity())
    for frame in list(model.frames)[1:]:
        if frame.type == pin.FrameType.BODY:
            new.addFrame(pin.Frame(frame.name, ids[frame.parentJoint], 0, frame.placement, frame.type), False)
    return new


def _change(model: pin.Model, change: InertiaChange, amount: float) -> None:
    parameters = model.inertias[change.joint].toDynamicParameters() + amount * change.direction
    model.inertias[change.joint] = pin.Inertia.FromDynamicParameters(parameters)


def _form(effect: object) -> str:
    return effect.form if isinstance(effect, Structure) else ""
