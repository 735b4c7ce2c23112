# SPDX-License-Identifier: BSD-3-Clause
"""The rigid bodies of a robot: accelerations, mass matrix and body rates with derivatives, from pinocchio.

All functions take many samples at once; where pinocchio has no call for many, it is called once per sample.
"""

from __future__ import annotations

import contextlib
import copy
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.body_rates import BodyRates
from jointscope.robots.errors import RobotError
from jointscope.robots.outside_modules import need_module

Array = NDArray[np.float64]


class RigidTree:
    """A tree of rigid bodies with one-axis joints, M(q) a + s c(q, v) + g(q) = tau.

    Args:
        urdf: path of the URDF.
        joints: names of the moving joints in the order of the state; all others stay locked.
        gravity: acceleration of gravity in the base frame, shape (3,) [m/s^2].
        coriolis: factor s on the Coriolis and centrifugal terms, 0 or 1.
        inertias: whether the bodies need inertias; without, only the kinematics can be used.
    """

    def __init__(self, urdf: Path, joints: Sequence[str], gravity: Array, coriolis: bool = True, inertias: bool = True):
        self.urdf = urdf
        self.joints = tuple(joints)
        self.coriolis = coriolis
        full = _read_urdf(urdf)
        self.model = _reduce(full, self.joints, urdf)
        self.model.gravity = pin.Motion(np.asarray(gravity, float), np.zeros(3))
        self.data = self.model.createData()
        self._pool = pin.ModelPool(self.model, 1)
        self._rates = BodyRates(self.model)
        self.gravity = np.asarray(gravity, float)
        if inertias:
            self._check_inertias()

    def with_model(self, model: pin.Model) -> RigidTree:
        """The same tree with other bodies or more joints; its inertias are not checked."""
        tree = copy.copy(self)
        tree.joints = tuple(list(model.names)[1:])
        tree.model, tree.data = model, model.createData()
        tree._pool = pin.ModelPool(model, 1)
        tree._rates = BodyRates(model)
        return tree

    def with_coriolis(self, coriolis: bool) -> RigidTree:
        """The same tree with or without Coriolis and centrifugal terms."""
        tree = copy.copy(self)
        tree.coriolis = coriolis
        return tree

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all links that can carry a sensor."""
        return tuple(f.name for f in self.model.frames if f.type == pin.FrameType.BODY)

    @property
    def slides(self) -> tuple[str, ...]:
        """Names of the prismatic joints, whose positions are lengths [m] and whose torques are forces [N]."""
        kinds = {name: joint.shortname() for name, joint in zip(self.model.names, self.model.joints, strict=True)}
        return tuple(joint for joint in self.joints if kinds[joint].startswith("JointModelP"))

    @property
    def limits(self) -> Array:
        """Lower and upper position limit of each joint, shape (n, 2) [rad]; infinite where the URDF gives none."""
        lower, upper = np.array(self.model.lowerPositionLimit), np.array(self.model.upperPositionLimit)
        given = upper > lower
        return np.column_stack([np.where(given, lower, -np.inf), np.where(given, upper, np.inf)])

    @property
    def velocity_limits(self) -> Array:
        """Velocity limit of each joint, shape (n,) [rad/s]; infinite where the URDF gives none."""
        limit = np.array(self.model.velocityLimit, dtype=float)
        return np.where(limit > 0, limit, np.inf)

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        """Joint accelerations M^-1 (tau - s c - g).

        Args:
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].
            tau: joint torques, shape (m, n) [N m].

        Returns:
            Accelerations, shape (m, n) [rad/s^2].
        """
        v = v if self.coriolis else np.zeros_like(v)
        if len(q) == 1:
            return np.asarray(pin.aba(self.model, self.data, q[0], v[0], tau[0]))[None]
        a = np.empty(q.shape[::-1], order="F")
        columns = (np.asfortranarray(part.T) for part in (q, v, tau))
        pin.abaInParallel(1, self._pool, *columns, a)
        return np.ascontiguousarray(a.T)

    def acceleration_derivatives(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array, Array]:
        """Joint accelerations and their derivatives.

        Args:
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].
            tau: joint torques, shape (m, n) [N m].

        Returns:
            a, shape (m, n); da/dq, da/dv and M^-1 = da/dtau, each of shape (m, n, n).
        """
        m, n = q.shape
        a, da_dq, da_dv, M_inverse = np.empty((m, n)), np.empty((m, n, n)), np.empty((m, n, n)), np.empty((m, n, n))
        v_used = v if self.coriolis else np.zeros_like(v)
        model, data, derivatives = self.model, self.data, pin.computeABADerivatives
        for k in range(m):
            da_dq[k], da_dv[k], M_inverse[k] = derivatives(model, data, q[k], v_used[k], tau[k])
            a[k] = data.ddq
        if not self.coriolis:
            da_dv[:] = 0.0
        return a, da_dq, da_dv, M_inverse

    def torque(self, q: Array, v: Array, a: Array) -> Array:
        """Joint torques M a + c + g of given motion, shape (m, n) [N m]; arguments of shape (m, n)."""
        tau = np.empty(q.shape[::-1], order="F")
        columns = (np.asfortranarray(part.T) for part in (q, v, a))
        pin.rneaInParallel(1, self._pool, *columns, tau)
        return np.ascontiguousarray(tau.T)

    def gravity_derivatives(self, q: Array) -> Array:
        """Derivative of the torques of gravity g(q) by q, shape (m, n, n) [N m/rad], for q of shape (m, n) [rad]."""
        by_q = np.empty((len(q), self.n, self.n))
        for k in range(len(q)):
            by_q[k] = pin.computeGeneralizedGravityDerivatives(self.model, self.data, q[k])
        return by_q

    def mass_matrix(self, q: Array) -> Array:
        """M(q), shape (m, n, n) [kg m^2], for positions q of shape (m, n) [rad]."""
        M = np.empty((len(q), self.n, self.n))
        for k in range(len(q)):
            M[k] = pin.crba(self.model, self.data, q[k])
        return M

    def free_inertias(self) -> Array:
        """Inertia of each coordinate at zero while all others are free to move, shape (n,) [kg m^2]."""
        M = self.mass_matrix(np.zeros((1, self.n)))[0]
        return np.asarray(1.0 / np.diag(np.linalg.inv(M)))

    def body_rate(self, body: str, q: Array, v: Array) -> tuple[Array, Array, Array]:
        """Angular velocity of a body in its own frame, with derivatives.

        Args:
            body: name of the link.
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].

        Returns:
            omega_body, shape (m, 3) [rad/s]; its derivatives by q and by v, each of shape (m, 3, n).
        """
        return self._rates.rate(self.frame_id(body), q, v)

    def body_poses(self, body: str, q: Array) -> tuple[Array, Array]:
        """Pose of a body in the base frame: R_base_body, shape (m, 3, 3), and p_base_body, shape (m, 3) [m]."""
        frame = self.frame_id(body)
        R, p = np.empty((len(q), 3, 3)), np.empty((len(q), 3))
        for k in range(len(q)):
            pin.forwardKinematics(self.model, self.data, q[k])
            pose = pin.updateFramePlacement(self.model, self.data, frame)
            R[k], p[k] = pose.rotation, pose.translation
        return R, p

    def joints_below(self, body: str) -> tuple[int, ...]:
        """Indices of the joints between the base and a link, base first."""
        joint = self.model.frames[self.frame_id(body)].parentJoint
        found = []
        while joint > 0:
            found.append(int(joint) - 1)
            joint = self.model.parents[joint]
        return tuple(found[::-1])

    def frame_id(self, body: str) -> int:
        """Index of a link in pinocchio's frames."""
        if body not in self.bodies:
            raise RobotError(f"{self.urdf.name} has no link {body!r}; it has {', '.join(self.bodies)}")
        return self.model.getFrameId(body, pin.FrameType.BODY)

    def _check_inertias(self) -> None:
        for joint, inertia in zip(self.model.names, self.model.inertias, strict=True):
            if joint == "universe":
                continue
            moments = np.linalg.eigvalsh(inertia.inertia)
            if inertia.mass < 0 or moments[0] <= 0 or moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
                raise RobotError(
                    f"{self.urdf.name}: the body moved by {joint} has an impossible inertia: principal moments "
                    f"{', '.join(f'{x:.4g}' for x in moments)} kg m2, mass {inertia.mass:g} kg; expected positive "
                    "moments of which none is larger than the sum of the other two"
                )


def moving_joints(urdf: Path) -> tuple[str, ...]:
    """Names of the joints with one axis and limits, base to tip.

    Raises:
        RobotError: no such file, no URDF, or none of its joints is of that kind.
    """
    model = _read_urdf(urdf)
    moving = list(zip(model.names, model.joints, strict=True))[1:]  # the first one is the universe
    names = [name for name, joint in moving if joint.nq == 1 and joint.nv == 1]
    if not names:
        raise RobotError(
            f"{urdf.name} has no moving joint that can be used: expected revolute or prismatic joints with limits "
            "(continuous ones: make them revolute, with limits of many turns)"
        )
    return tuple(names)


def _read_urdf(urdf: Path) -> pin.Model:
    if not urdf.is_file():
        raise RobotError(f"the URDF {urdf} does not exist; set `urdf` in the robot file, relative to that file")
    need_module("pinocchio")
    try:
        with _quiet_stderr():
            return pin.buildModelFromUrdf(str(urdf))
    except Exception as err:
        raise RobotError(f"{urdf} is not a URDF that pinocchio can read: {str(err).splitlines()[0]}") from err


@contextlib.contextmanager
def _quiet_stderr() -> Iterator[None]:
    """Keeps the parser's own lines, written from C++, off the screen; its exception says the same."""
    try:
        saved = os.dup(2)
    except OSError:
        yield  # there is no stderr to keep quiet
        return
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)


def _reduce(model: pin.Model, joints: tuple[str, ...], urdf: Path) -> pin.Model:
    """The model with only `joints` moving, all others locked at zero."""
    known = list(model.names)[1:]
    unknown = [joint for joint in joints if joint not in known]
    if unknown:
        raise RobotError(f"{urdf.name} has no moving joint {unknown[0]!r}; it has {', '.join(known)}")
    locked = [model.getJointId(name) for name in known if name not in joints]
    reduced = pin.buildReducedModel(model, locked, pin.neutral(model)) if locked else model
    if tuple(list(reduced.names)[1:]) != joints:
        raise RobotError(f"joints must be listed as in {urdf.name}: {', '.join(list(reduced.names)[1:])}")
    if reduced.nq != len(joints) or reduced.nv != len(joints):
        raise RobotError(f"{urdf.name}: continuous and floating joints are not supported; use revolute or prismatic")
    return reduced
