# SPDX-License-Identifier: BSD-3-Clause
"""The rigid bodies of a robot: accelerations, mass matrix and body rates with derivatives, from pinocchio.

All functions take many samples at once; where pinocchio has no call for many, it is called once per sample.
"""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.bodies.body_accelerations import BodyAccelerations
from jointscope.robots.bodies.body_rates import BodyRates
from jointscope.robots.bodies.coupling import Coupling, with_new_joints
from jointscope.robots.bodies.equations_of_motion import Equations, OwnData, equations_of
from jointscope.robots.bodies.possible_inertias import check_inertias
from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.mimic_joints import Follower
from jointscope.robots.urdf.urdf_bodies import UrdfBodies
from jointscope.robots.urdf.usable_joints import (
    check_locked,
    check_moving,
    check_within_limits,
)

Array = NDArray[np.float64]
NOWHERE: Mapping[str, float] = MappingProxyType({})


class RigidTree:
    """A tree of rigid bodies with one-axis joints, M(q) a + s c(q, v) + g(q) = tau.

    Joints that are not named stay locked; mimic joints of the URDF follow theirs, with what they carry.

    Args:
        urdf: path of the URDF.
        joints: names of the moving joints in the order of the state.
        gravity: acceleration of gravity in the base frame, shape (3,) [m/s^2].
        coriolis: factor s on the Coriolis and centrifugal terms, 0 or 1.
        inertias: whether the bodies need inertias; without, only the kinematics can be used.
        locked: positions of other joints [rad] or [m]; zero where none is given.

    Attributes:
        model: pinocchio model of what moves, one coordinate for each moving joint of the URDF.
        coupling: coordinates of the model from those of `joints`; None where they are the same.
        locked: as given.
        remarks: what is odd about the inertias without making the equations impossible, sentences.
        massless: joints that move no inertia; they have equations where a rotor drives them without a spring.

    Raises:
        RobotError: no such joint, one that cannot move or be locked, or inertias without equations of motion.
    """

    def __init__(
        self,
        urdf: Path,
        joints: Sequence[str],
        gravity: Array,
        coriolis: bool = True,
        inertias: bool = True,
        locked: Mapping[str, float] = NOWHERE,
    ):
        self.urdf = urdf
        self.joints = tuple(joints)
        self.coriolis = coriolis
        self.gravity = np.asarray(gravity, float)
        self._bodies = UrdfBodies.read(urdf)
        check_moving(self._bodies, self.joints)
        check_locked(self._bodies, self.joints, locked)
        check_within_limits(self._bodies, locked)
        self.remarks: tuple[str, ...] = ()
        self.massless: tuple[str, ...] = ()
        self._need_inertias = inertias
        self._relatives: dict[tuple[tuple[str, float], ...], RigidTree] = {}  # the same tree in other postures
        self._lock(locked)
        self._relatives[_key(self.locked)] = self

    def locked_at(self, positions: Mapping[str, float]) -> RigidTree:
        """The same tree with other joints locked, all at these positions [rad] or [m], zero where none is given.

        Raises:
            RobotError: as when it is made.
        """
        key = _key(positions)
        if key not in self._relatives:
            check_locked(self._bodies, self.joints, positions)
            tree = copy.copy(self)
            tree._lock(positions)
            self._relatives[key] = tree
        return self._relatives[key]

    def posture(self, positions: Mapping[str, float]) -> dict[str, float]:
        """Of some positions, those that tell where other joints are which matter, in the order of the URDF.

        A mimic joint tells where the joint is that it follows, if that is not given itself.
        """
        if not positions:
            return {}
        given = self._bodies.leading(positions)
        return {name: float(given[name]) for name in self.other_joints if name in given}

    def with_model(self, model: pin.Model) -> RigidTree:
        """The same tree with other bodies or more joints; its inertias are not checked."""
        tree = copy.copy(self)
        tree._relatives = {}
        tree.joints = with_new_joints(self.joints, tuple(model.names)[1:], tuple(self.model.names)[1:])
        tree._use(model)
        return tree

    def _lock(self, locked: Mapping[str, float]) -> None:
        self.locked = {name: float(position) for name, position in locked.items()}
        model = self._bodies.reduced(self.joints, self.locked)
        model.gravity = pin.Motion(self.gravity, np.zeros(3))
        self._use(model)
        if self._need_inertias:
            complaints = tuple(f"{self.urdf.name}: {complaint}" for complaint in self._bodies.complaints)
            odd, self.massless = check_inertias(self.urdf.name, model, self.joints, self.mass_matrix, self.limits)
            self.remarks = complaints + odd

    def _use(self, model: pin.Model) -> None:
        self.model, self.own = model, OwnData(model)
        self.coupling = Coupling.of(tuple(model.names)[1:], self.joints, self._bodies.followers)
        self.equations: Equations = equations_of(model, self.coupling)
        self._rates, self.accelerations = BodyRates(model, self.coupling), BodyAccelerations(model)

    def with_coriolis(self, coriolis: bool) -> RigidTree:
        """The same tree with or without Coriolis and centrifugal terms."""
        tree = copy.copy(self)
        tree.coriolis, tree._relatives = coriolis, {}
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
        return tuple(joint for joint in self.joints if self.is_slide(joint))

    @property
    def other_joints(self) -> tuple[str, ...]:
        """Names of the joints of the URDF beside `joints` whose position matters for the equations of `joints`."""
        return self._bodies.that_matter(self.joints)

    def is_slide(self, joint: str) -> bool:
        """Whether any joint of the URDF, in `joints` or not, is prismatic; False for what is no joint."""
        return self._bodies.is_slide(joint)

    @property
    def followers(self) -> dict[str, Follower]:
        """The mimic joints that move, by name."""
        moving = tuple(self.model.names)
        return {name: follower for name, follower in self._bodies.followers.items() if name in moving}

    @property
    def limits(self) -> Array:
        """Lower and upper position limit of each joint, shape (n, 2) [rad]; infinite where the URDF gives none.

        What follows a joint limits it, too.
        """
        lower, upper = np.array(self.model.lowerPositionLimit), np.array(self.model.upperPositionLimit)
        given = upper > lower
        limits = np.column_stack([np.where(given, lower, -np.inf), np.where(given, upper, np.inf)])
        return limits if self.coupling is None else self.coupling.limits(limits)

    @property
    def velocity_limits(self) -> Array:
        """Velocity limit of each joint, shape (n,) [rad/s]; infinite where the URDF gives none."""
        limit = np.array(self.model.velocityLimit, dtype=float)
        limits = np.where(limit > 0, limit, np.inf)
        return limits if self.coupling is None else self.coupling.velocity_limits(limits)

    @property
    def effort_limits(self) -> Array:
        """Effort limit of each joint as the URDF has it, shape (n,) [N m]."""
        return np.array(self.model.effortLimit, dtype=float)[[self.coordinate(joint) for joint in self.joints]]

    def coordinate(self, joint: str) -> int:
        """Index of a moving joint among the coordinates of `model`."""
        return int(self.model.joints[self.model.getJointId(joint)].idx_v)

    def acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        """Joint accelerations M^-1 (tau - s c - g).

        Args:
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].
            tau: joint torques, shape (m, n) [N m].

        Returns:
            Accelerations, shape (m, n) [rad/s^2].
        """
        return self.equations.acceleration(q, v if self.coriolis else np.zeros_like(v), tau)

    def acceleration_derivatives(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array, Array]:
        """Joint accelerations and their derivatives.

        Args:
            q: positions, shape (m, n) [rad].
            v: velocities, shape (m, n) [rad/s].
            tau: joint torques, shape (m, n) [N m].

        Returns:
            a, shape (m, n); da/dq, da/dv and M^-1 = da/dtau, each of shape (m, n, n).
        """
        found = self.equations.derivatives(q, v if self.coriolis else np.zeros_like(v), tau)
        if not self.coriolis:
            found[2][:] = 0.0
        return found

    def torque(self, q: Array, v: Array, a: Array) -> Array:
        """Joint torques M a + c + g of given motion, shape (m, n) [N m]; arguments of shape (m, n)."""
        return self.equations.torque(q, v, a)

    def gravity_derivatives(self, q: Array) -> Array:
        """Derivative of the torques of gravity g(q) by q, shape (m, n, n) [N m/rad], for q of shape (m, n) [rad]."""
        return self.equations.gravity_derivatives(q)

    def mass_matrix(self, q: Array) -> Array:
        """M(q), shape (m, n, n) [kg m^2], for positions q of shape (m, n) [rad]."""
        return self.equations.mass_matrix(q)

    def weighing_inertia(self, q: Array) -> Array:
        """M(q) as it weighs noise, shape (m, n, n) [kg m^2]: with a unit inertia for joints that move none."""
        M = self.mass_matrix(q)
        return M + np.diag([float(joint in self.massless) for joint in self.joints]) if self.massless else M

    def free_inertias(self) -> Array:
        """Weighing inertia of each coordinate at zero while all others are free to move, shape (n,) [kg m^2]."""
        M = self.weighing_inertia(np.zeros((1, self.n)))[0]
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

    def sensed_rate(
        self, body: str, R_sensor_body: Array, q: Array, v: Array, derivatives: bool
    ) -> tuple[Array, Array, Array]:
        """As `body_rate`, in the axes of a sensor on the body; derivatives that are not wanted have length 0."""
        return self._rates.sensed(self.frame_id(body), R_sensor_body, q, v, derivatives)

    def joint_rates(self, q: Array, v: Array, wanted: Collection[int] | None = None) -> dict[int, Array]:
        """Angular velocities behind joints of `model`, see `BodyRates.of_joints`, each of shape (m, 3) [rad/s]."""
        return self._rates.of_joints(q, v, wanted)

    def body_poses(self, body: str, q: Array) -> tuple[Array, Array]:
        """Pose of a body in the base frame: R_base_body, shape (m, 3, 3), and p_base_body, shape (m, 3) [m]."""
        frame = self.frame_id(body)
        q = q if self.coupling is None else self.coupling.positions(q)
        R, p = np.empty((len(q), 3, 3)), np.empty((len(q), 3))
        for k in range(len(q)):
            pin.forwardKinematics(self.model, self.own.data, q[k])
            pose = pin.updateFramePlacement(self.model, self.own.data, frame)
            R[k], p[k] = pose.rotation, pose.translation
        return R, p

    def joints_below(self, body: str) -> tuple[int, ...]:
        """Indices of the joints between the base and a link, base first."""
        joint = self.model.frames[self.frame_id(body)].parentJoint
        found = []
        while joint > 0:
            found.append(int(joint) - 1)
            joint = self.model.parents[joint]
        if self.coupling is None:
            return tuple(found[::-1])
        columns = [int(i) for row in found[::-1] for i in np.flatnonzero(self.coupling.G[row])]
        return tuple(dict.fromkeys(columns))

    def frame_id(self, body: str) -> int:
        """Index of a link in pinocchio's frames."""
        if body not in self.bodies:
            raise RobotError(f"{self.urdf.name} has no link {body!r}; it has {', '.join(self.bodies)}")
        return self.model.getFrameId(body, pin.FrameType.BODY)


def _key(positions: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((name, float(position)) for name, position in positions.items()))
