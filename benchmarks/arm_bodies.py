# SPDX-License-Identifier: BSD-3-Clause
"""The equations of motion of the joints that move: MuJoCo's mass matrix and bias of a tree without anything else.

All joints that are held are welded at their posture, so that what is left is one body per joint that moves, with the
inertia of all links that hang on it. Mimic joints are bodies of their own that a matrix ties to the joint they follow:
q_all = G q + offset, M = G' M_all G, c = G' c_all.

MuJoCo's own import of URDFs is not used: it drops the mass of fixed links on the base and refuses inertias that no
body can have, which makers' files do contain. Such inertias are put in after the compiler has had its look.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from arm_urdf import Urdf, UrdfJoint
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
WORLD = ""
GRAVITY = 9.81  # [m/s2]


@dataclass
class _Body:
    """Links that move as one, in the frame of the joint that moves them."""

    mass: float = 0.0
    moment: Array = field(default_factory=lambda: np.zeros(3))
    about_origin: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def add(self, mass: float, com: Array, inertia: Array) -> None:
        self.mass += mass
        self.moment = self.moment + mass * com
        self.about_origin = self.about_origin + inertia + _steiner(mass, com)

    def principal(self) -> tuple[Array, Array, Array]:
        """Centre of mass, moments of inertia about it, and the rotation of their axes."""
        com = self.moment / self.mass if self.mass else np.zeros(3)
        moments, R_body_axes = np.linalg.eigh(self.about_origin - _steiner(self.mass, com))
        R_body_axes[:, 2] *= np.sign(np.linalg.det(R_body_axes))
        return com, moments, R_body_axes


def _steiner(mass: float, com: Array) -> Array:
    return mass * (com @ com * np.eye(3) - np.outer(com, com))


class ArmBodies:
    """Mass matrix and bias of some joints of a robot, all others held.

    Args:
        urdf: the robot.
        joints: names of the joints that are free to move, none of them a mimic.
        posture: angle or position of every other joint that is no mimic [rad or m].
    """

    def __init__(self, urdf: Urdf, joints: Sequence[str], posture: Mapping[str, float]):
        self.joints = tuple(joints)
        followed = {name: urdf.driver(name) for name, joint in urdf.joints.items() if joint.moves}
        self.moving = [name for name in followed if followed[name].of in joints]
        self.moving.sort(key=lambda name: len(urdf.above(urdf.joints[name].child)))  # parents first
        self.G = np.zeros((len(self.moving), len(joints)))
        self.offset = np.zeros(len(self.moving))
        for row, name in enumerate(self.moving):
            self.G[row, self.joints.index(followed[name].of)] = followed[name].factor
            self.offset[row] = followed[name].offset
        held = {
            name: mimic.factor * posture[mimic.of] + mimic.offset
            for name, mimic in followed.items()
            if name not in self.moving
        }
        self._compile(urdf, held)
        self._all = np.zeros(len(self.moving))
        self._full = np.zeros((len(self.moving), len(self.moving)))

    def mass_matrix(self, q: Array) -> Array:
        """M of the joints, without rotors, shape (n, n)."""
        return self.mass_and_bias(q, np.zeros(len(q)))[0]

    def mass_and_bias(self, q: Array, v: Array) -> tuple[Array, Array]:
        """M, shape (n, n), and the torque of gravity, Coriolis and centrifugal terms, shape (n,)."""
        model, data = self._model, self._data
        data.qpos[:] = self.G @ q + self.offset
        data.qvel[:] = self.G @ v
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self._all)
        mujoco.mj_fullM(model, data, self._full)
        return self.G.T @ self._full @ self.G, self.G.T @ self._all

    @property
    def engine(self) -> mujoco.MjModel:
        """A copy of MuJoCo's model, its joints in the order of `moving`; nothing but bodies is in it."""
        return copy.copy(self._model)

    def _compile(self, urdf: Urdf, held: Mapping[str, float]) -> None:
        bodies: dict[str, _Body] = {name: _Body() for name in (WORLD, *self.moving)}
        frames: dict[str, tuple[str, Array]] = {urdf.root: (WORLD, np.eye(4))}
        starts: dict[str, tuple[str, Array]] = {}
        order = [link for link in urdf.links if link != urdf.root]
        order.sort(key=lambda link: len(urdf.above(link)))
        for link in order:
            joint = urdf.above(link)[-1]
            owner, T_owner_parent = frames[joint.parent]
            T_owner_joint = T_owner_parent @ joint.T_parent_joint
            if joint.name in self.moving:
                starts[joint.name] = (owner, T_owner_joint)
                frames[link] = (joint.name, np.eye(4))
            else:
                frames[link] = (owner, T_owner_joint @ _motion(joint, held.get(joint.name, 0.0)))
        for link, (owner, T_owner_link) in frames.items():
            part, R = urdf.links[link], T_owner_link[:3, :3]
            bodies[owner].add(part.mass, R @ part.com + T_owner_link[:3, 3], R @ part.inertia @ R.T)
        self._build(urdf, bodies, starts)

    def _build(self, urdf: Urdf, bodies: Mapping[str, _Body], starts: Mapping[str, tuple[str, Array]]) -> None:
        spec = mujoco.MjSpec()
        spec.option.gravity = [0.0, 0.0, -GRAVITY]
        made = {WORLD: spec.worldbody}
        for name in self.moving:
            owner, T = starts[name]
            com, _, R = bodies[name].principal()
            body = made[owner].add_body(name=name, pos=T[:3, 3], quat=_quaternion_wxyz(T[:3, :3]))
            body.explicitinertial = True
            body.ipos, body.iquat = com, _quaternion_wxyz(R)
            body.mass, body.inertia = 1.0, [1.0, 1.1, 1.2]  # any that the compiler accepts; see below
            slides = urdf.joints[name].kind == "prismatic"
            kind = mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE
            body.add_joint(name=name, type=kind, axis=urdf.joints[name].axis)
            made[name] = body
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        for name in self.moving:
            index = self._model.body(name).id
            self._model.body_mass[index] = bodies[name].mass
            self._model.body_inertia[index] = bodies[name].principal()[1]
        # the compiler keeps the inertia of bodies that turn nothing else as a constant
        self._model.body_simple[:] = 0
        self._model.dof_simplenum[:] = 0
        # the masses that hang on each body, which the compiler had summed up; its own function for that refuses bodies
        # without mass
        self._model.body_subtreemass[:] = self._model.body_mass
        for index in range(self._model.nbody - 1, 0, -1):
            self._model.body_subtreemass[self._model.body_parentid[index]] += self._model.body_subtreemass[index]
        if [self._model.joint(k).name for k in range(self._model.njnt)] != self.moving:
            self._reorder()

    def _reorder(self) -> None:
        """MuJoCo goes down one branch after the other."""
        names = [self._model.joint(k).name for k in range(self._model.njnt)]
        rows = [self.moving.index(name) for name in names]
        self.moving, self.G, self.offset = names, self.G[rows], self.offset[rows]


def _motion(joint: UrdfJoint, q: float) -> Array:
    T = np.eye(4)
    if joint.kind == "prismatic":
        T[:3, 3] = q * joint.axis
    elif joint.moves:
        T[:3, :3] = Rotation.from_rotvec(q * joint.axis).as_matrix()
    return T


def _quaternion_wxyz(R: Array) -> Array:
    return np.roll(Rotation.from_matrix(R).as_quat(), 1)
