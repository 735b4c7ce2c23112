# SPDX-License-Identifier: BSD-3-Clause
"""An arm with a spring behind each motor that is shaken and springs in its bearings, linearised about a motion.

Other joints are locked, rigidly, or by a spring where the robot has a stiffness for them.

    M(t) x'' + C(t) x' + G(t) x + D x' + K x = E (d m' + k m)

x are the turns of the joints behind the drives and the tilts of their bearings about y' and x', m the turns of the
motors; K and D are diagonal. Where a motion carries the excitation, M, C and G change with its
phase; they come as coefficients of a Fourier series in it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.equations_of_motion import FreeEquations
from jointscope.robots.bodies.misplaced_joints import across, misplaced, turned
from jointscope.robots.errors import RobotError
from jointscope.robots.geometry.error_parameters import (
    BEARING,
    DAMPING,
    LINK_INERTIA,
    LINK_MASS,
    LINK_MOMENTS,
    PAYLOAD,
    STIFFNESS,
    TILT_DAMPING,
)
from jointscope.robots.model.robot import Robot
from jointscope.robots.urdf.motion_axis import motion_axis

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
PHASES = 16  # of the motion at which the arm is linearised
LOOKS = 3  # at gravity, for the place where the arm sags
LOSS = 3e-4  # [s] damping over stiffness of a spring without a damper in the robot file: 1 % of critical at 10 Hz


@dataclass(frozen=True)
class Linearised:
    """Fourier coefficients of M, C and G in the phase of a motion, from that of e^(-i h phase) to e^(i h phase).

    Attributes:
        M: inertias, shape (2 h + 1, n, n).
        C: by velocities, same shape.
        G: by positions, same shape.
    """

    M: Complex
    C: Complex
    G: Complex

    @property
    def mean(self) -> tuple[Array, Array, Array]:
        """What does not change with the phase."""
        middle = len(self.M) // 2
        return self.M[middle].real, self.C[middle].real, self.G[middle].real


@dataclass(frozen=True)
class Spring:
    """A spring and its damper.

    Attributes:
        stiffness, damping: names of their parameters.
        coordinate: place in x.
        motor: number of the motor on its other side; None for a bearing and for a joint that is locked.
    """

    stiffness: str
    damping: str
    coordinate: int
    motor: int | None


class FlexibleArm:
    """The arm of a robot with a section `frequency`.

    Args:
        robot: the robot.

    Attributes:
        joints: whose motors are shaken.
        springs: of drives and bearings, in the order of x.

    Raises:
        RobotError: a joint that is shaken does not turn.
    """

    def __init__(self, robot: Robot):
        assert robot.frequency is not None
        slide = next((joint for joint in robot.frequency.joints if robot.tree.is_slide(joint)), None)
        if slide is not None:
            raise RobotError(f"{robot.path.name}: frequency.joints: {slide} slides; expected joints that turn")
        self._tree, self.joints = robot.tree, robot.frequency.joints
        self._target = None if robot.poses is None else (robot.poses.link, robot.poses.at)
        springs: list[Spring] = []
        model, parameters = robot.tree.model, robot.parameters
        moving = [name for name in model.names[1:] if name in robot.tree.joints and not robot.tree.is_slide(name)]
        for joint in moving:
            motor = self.joints.index(joint) if joint in self.joints else None
            if motor is not None or f"{joint}.{STIFFNESS}" in parameters:
                springs.append(Spring(f"{joint}.{STIFFNESS}", f"{joint}.{DAMPING}", len(springs), motor))
            if all(f"{joint}.{part}" in parameters for part in BEARING):
                for i in (1, 0):  # y', then x'
                    names = f"{joint}.{BEARING[i]}", f"{joint}.{TILT_DAMPING[i]}"
                    springs.append(Spring(*names, len(springs), None))
        self.springs = tuple(springs)
        self.driven = np.array([next(s.coordinate for s in springs if s.motor == i) for i in range(len(self.joints))])
        self._turning = {s.stiffness.split(".")[0] for s in springs if s.stiffness.endswith(f".{STIFFNESS}")}
        self._tilting = {s.stiffness.split(".")[0] for s in springs if s.stiffness.endswith(BEARING)}

    def dynamic(self, w: Array, values: Mapping[str, float]) -> Complex:
        """Stiffness k + j w d of every spring at some frequencies, shape (l, s) [N m/rad].

        Args:
            w: shape (l,) [rad/s].
            values: of stiffnesses and dampings by name.
        """
        k = np.array([values[spring.stiffness] for spring in self.springs])
        d = [values.get(s.damping, LOSS * size) for s, size in zip(self.springs, k, strict=True)]
        return np.asarray(k + 1j * w[:, None] * d)

    def linearised(
        self,
        q: Array,
        values: Mapping[str, float],
        carrier: Complex | None = None,
        speed: float = 0.0,
        harmonics: int = 0,
    ) -> Linearised:
        """The arm about a pose, or about a motion q + 2 Re(carrier e^(i phase)) of the joints that are shaken.

        Args:
            q: mean positions of all joints of the robot, shape (n,) [rad].
            values: geometric errors and stiffnesses by name.
            carrier: complex amplitude of the motion of each motor, shape (n shaken,) [rad]; None for none.
            speed: of its phase [rad/s].
            harmonics: h of the result.
        """
        model = self._model(q, values)
        data = model.createData()
        at = np.zeros(model.nq)
        at[self.driven] = [q[self._tree.joints.index(joint)] for joint in self.joints]
        k = np.array([values[spring.stiffness] for spring in self.springs])
        rest = at.copy()
        for _ in range(LOOKS):
            rest = at - pin.computeGeneralizedGravity(model, data, rest) / k
        found = []
        phases = 2.0 * np.pi * np.arange(PHASES if harmonics else 1) / PHASES
        for phase in phases:
            here, v, a = rest.copy(), np.zeros(model.nv), np.zeros(model.nv)
            if carrier is not None and harmonics:
                turning = 2.0 * carrier * np.exp(1j * phase)
                here[self.driven] += turning.real
                v[self.driven] = (1j * speed * turning).real
                a[self.driven] = (-(speed**2) * turning).real
            pin.computeRNEADerivatives(model, data, here, v, a)
            M = np.triu(data.M) + np.triu(data.M, 1).T
            found.append((M, data.dtau_dv.copy(), data.dtau_dq.copy()))
        series = [np.fft.fft(np.array(part), axis=0) / len(phases) for part in zip(*found, strict=True)]
        kept = np.arange(-harmonics, harmonics + 1)
        return Linearised(*(part[kept] for part in series))

    def equations(self, q: Array, values: Mapping[str, float]) -> FreeEquations:
        """Equations of motion of the turns x in a pose, springs and dampers left out.

        Args:
            q: mean positions of all joints of the robot, shape (n,) [rad].
            values: geometric errors by name.
        """
        return FreeEquations(self._model(q, values))

    def _model(self, q: Array, values: Mapping[str, float]) -> pin.Model:
        """The bodies with hinges for drives and bearings, other joints welded where they stand."""
        old, new = self._tree.model, pin.Model()
        new.gravity = old.gravity
        host: dict[int, tuple[int, pin.SE3]] = {0: (0, pin.SE3.Identity())}
        for j in range(1, old.njoints):
            name, (parent, T) = old.names[j], host[old.parents[j]]
            along, x, y = across(motion_axis(old.joints[j])[3:])
            placed = T * misplaced(old.jointPlacements[j], name, values, (along, x, y))
            turn = turned(along, np.array(q[self._tree.joints.index(name)] if name in self._tree.joints else 0.0))
            locked = pin.SE3(turn, np.zeros(3))
            if name in self._turning:
                placed = placed if name in self.joints else placed * locked
                parent, placed = new.addJoint(parent, _hinge(along), placed, name), pin.SE3.Identity()
            else:
                placed = placed * locked
            for axis, end in ((y, ".y"), (x, ".x")) if name in self._tilting else ():
                parent, placed = new.addJoint(parent, _hinge(axis), placed, name + end), pin.SE3.Identity()
            host[j] = parent, placed
            new.appendBodyToJoint(parent, _with_masses(old.inertias[j], name, along, values), placed)
        if values.get(PAYLOAD, 0.0) and self._target is not None:
            frame = old.frames[self._tree.frame_id(self._target[0])]
            parent, placed = host[frame.parentJoint]
            point = pin.Inertia(values[PAYLOAD], np.array(frame.placement.act(self._target[1])), np.zeros((3, 3)))
            new.appendBodyToJoint(parent, point, placed)
        return new


def _hinge(axis: Array) -> pin.JointModelRevoluteUnaligned:
    return pin.JointModelRevoluteUnaligned(axis)


def _with_masses(body: pin.Inertia, name: str, along: Array, values: Mapping[str, float]) -> pin.Inertia:
    """A link of more of its own material than the URDF says, other first moments, more inertia about its joint."""
    mass, more = values.get(f"{name}.{LINK_MASS}", 0.0), values.get(f"{name}.{LINK_INERTIA}", 0.0)
    moments = np.array([values.get(f"{name}.{part}", 0.0) for part in LINK_MOMENTS])
    if not (mass or more or np.any(moments)):
        return body
    found = np.array(body.toDynamicParameters())
    found += mass * (found / body.mass if body.mass > 0.0 else np.eye(10)[0])
    found[1:4] += moments
    about = more * np.outer(along, along)
    found[4:] += about[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    return pin.Inertia.FromDynamicParameters(found)
