# SPDX-License-Identifier: BSD-3-Clause
"""All poses of a session as one set of states: what each transmission does in each pose that no encoder sees.

    target_measured = tracker(target(q_motor + e, values)) + noise,    e = 0 +- repeatability of each joint

Eliminating e leaves the covariance J S J' of the transmissions in every pose, which is no sphere. Where a contact holds
the target, the unknown point of the contact takes the place of the measured position. Several targets on the tool, and
their orientations, are more rows of the same pose: they share its e.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.block import POINT, POSE3, Block
from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.sagging_arm import SaggingArm, SaggingPoint, in_tracker
from jointscope.graphs.poses.seen_targets import SeenTargets
from jointscope.graphs.rest_sets.independent_states import of_independent_states
from jointscope.graphs.solving.normal_equations import NormalEquations
from jointscope.robots.geometry.rotations import log_slopes
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses

Array = NDArray[np.float64]


TRACKER_POSE = Block("tracker_pose", POSE3, "recording", 6, "t")


def contact_block(contact: str) -> str:
    """Name of the block with the point of a contact."""
    return f"contact.{contact}"


@dataclass(frozen=True)
class PoseSet:
    """Poses as the solver sees them (`SetProblem`).

    Attributes:
        robot: with a section `poses`.
        poses: the poses.
        tracker: base from tracker, shape (4, 4).
        repeatability: factor on the joints' sigmas of the robot file.
        owner: number of the session; None for a whole one.
        turning: factor on the sigma of orientations of the robot file.
        own_tracker: whether nothing says where the tracker of this session stands, so that its pose is a value, too.
    """

    robot: Robot
    poses: Poses
    tracker: Array
    repeatability: float = 1.0
    owner: int | None = None
    turning: float = 1.0
    own_tracker: bool = False

    kind = "poses"
    priors = ()

    @property
    def measured(self) -> int:
        """Number of measured coordinates."""
        return int(self.targets.there.sum())

    @property
    def of_first(self) -> PoseSet:
        """The poses in which the first target was seen, and its place only."""
        return replace(self, poses=self.poses.of_first)

    def of_robot(self, robot: Robot) -> PoseSet:
        """The same poses of a robot with other values."""
        return replace(self, robot=robot)

    @cached_property
    def arm(self) -> SaggingArm:
        """The robot's arm."""
        return SaggingArm(self.robot)

    @cached_property
    def targets(self) -> SeenTargets:
        """What was seen, as k rows of each pose."""
        return SeenTargets(self.robot, self.poses)

    @cached_property
    def noise(self) -> Array:
        """Of the rows of a pose, 1 sigma, shape (k,) [m], [rad]."""
        setup = self.robot.poses
        assert setup is not None
        return np.where(self.targets.turns, setup.turn_sigma * self.turning, setup.target_sigma)

    @cached_property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts, in the order of the poses."""
        return tuple(dict.fromkeys(self.poses.contacts))

    @cached_property
    def sigmas(self) -> Array:
        """Of the transmissions of the chain's joints, shape (n,) [rad]."""
        assert self.robot.poses is not None
        return self.robot.poses.joint_sigmas[self.arm.chain.places] * self.repeatability

    @property
    def q(self) -> Array:
        """Measured angles of the chain's joints, shape (m, n) [rad]."""
        return self.poses.q[:, self.arm.chain.places]

    def start(self, common: Calibration) -> tuple[Array, Calibration]:
        """No transmission error; contacts where the start values have the target on average."""
        calibration = common.only([DYNAMICS])
        if self.own_tracker:
            calibration = calibration.with_blocks([(TRACKER_POSE, self.tracker)])
        if self.contacts:
            target = self.point(calibration).target
            named = np.array(self.poses.contacts)
            calibration = calibration.with_blocks(
                [
                    (Block(contact_block(c), POINT, "contact", 3, "c", i), target[named == c].mean(axis=0))
                    for i, c in enumerate(self.contacts)
                ]
            )
        return np.zeros_like(self.q), calibration

    def values(self, calibration: Calibration) -> dict[str, float]:
        """Values of all parameters, those that are held included."""
        held = {name: p.value for name, p in self.robot.parameters.items() if p.fixed}
        return held | calibration.by_name

    def point(self, calibration: Calibration, e: Array | None = None) -> SaggingPoint:
        """Rows of what was seen: in the axes of the tracker, or in those of the base where contacts hold the target.

        Args:
            calibration: the values.
            e: what transmissions do unseen, shape (m, n) [rad]; None for nothing.
        """
        tracker = calibration[TRACKER_POSE.name] if TRACKER_POSE.name in calibration.layout else self.tracker
        return self.seen(self.values(calibration), e, tracker)

    def seen(self, values: Mapping[str, float], e: Array | None = None, tracker: Array | None = None) -> SaggingPoint:
        """The same for values of all parameters by name, and a tracker that may stand elsewhere."""
        found = self.arm.at(self.q, np.zeros_like(self.q) if e is None else e, values, not self.targets.plain)
        if not self.poses.contacts:
            found = in_tracker(found, self.tracker if tracker is None else tracker, values, self.poses.shares)
        return self.targets.rows(found, values)

    def columns(self, point: SaggingPoint, calibration: Calibration) -> Array:
        """Derivative of what is predicted less what is measured by all coordinates of the calibration, (m, k, p)."""
        J = np.zeros((*self.targets.there.shape, calibration.size))
        start = calibration.columns[DYNAMICS].start
        for i, (name, scale) in enumerate(zip(calibration.names, calibration.value_by_coordinate, strict=True)):
            if name in point.by_value:
                J[:, :, start + i] = scale * point.by_value[name]
        if self.own_tracker:
            J[:, :, calibration.columns[TRACKER_POSE.name]] = self._by_tracker(point)
        for contact in self.contacts:
            here = [c == contact for c in self.poses.contacts]
            J[here, :, calibration.columns[contact_block(contact)]] = -np.eye(3)
        return J

    def _by_tracker(self, point: SaggingPoint) -> Array:
        """Derivative of the rows by a turn and a shift of the tracker in its own axes, shape (m, k, 6).

        What is seen at p is seen at exp(-w) (p - v), and turned by exp(-w).
        """
        seen = point.target.reshape(len(point.target), -1, 3)
        slopes, turns = np.zeros((*seen.shape, 6)), self.targets.turns[::3]
        slopes[:, ~turns, :, :3] = -np.swapaxes(np.cross(np.eye(3), seen[:, ~turns, None]), 2, 3)
        slopes[:, ~turns, :, 3:] = -np.eye(3)
        for i in np.flatnonzero(turns):
            slopes[:, i, :, :3] = -log_slopes(seen[:, i])
        return np.asarray(self.targets.there[:, :, None] * slopes.reshape(len(seen), -1, 6))

    def misses(self, point: SaggingPoint, calibration: Calibration) -> Array:
        """Rows of what is predicted less what was measured, shape (m, k) [m], [rad]."""
        if self.poses.target is not None:
            return point.target - (self.poses.target if self.targets.plain else self.targets.measured)
        return point.target - np.array([calibration[contact_block(c)] for c in self.poses.contacts])

    def covariances(self, point: SaggingPoint) -> Array:
        """Of what is missed: transmissions and noise of the target, shape (m, k, k) [m^2], [rad^2]."""
        J = point.by_joint * self.sigmas
        return np.asarray(J @ np.swapaxes(J, 1, 2) + np.diag(self.noise**2))

    @property
    def own_coordinates(self) -> int:
        """Number of coordinates of values that are this session's alone: points of contacts, pose of the tracker."""
        return 3 * len(self.contacts) + 6 * self.own_tracker

    @cached_property
    def pairs(self) -> dict[str, tuple[str, str]]:
        """The two contacts of each place that has two."""
        by_place: dict[str, list[str]] = {}
        for contact, place in self.poses.places:
            by_place.setdefault(place, []).append(contact)
        return {place: (found[0], found[1]) for place, found in by_place.items() if len(found) == 2}

    def linearize(self, x: Array, calibration: Calibration) -> NormalEquations:
        """Normal equations at transmission errors of shape (m, n)."""
        point, each = self.point(calibration, x), self.noise[:, None]
        own = np.broadcast_to(np.diag(1.0 / self.sigmas), (*x.shape, x.shape[1]))
        no = np.zeros((*x.shape, calibration.size))
        system = of_independent_states(
            np.hstack([self.misses(point, calibration) / self.noise, x / self.sigmas]),
            np.hstack([point.by_joint / each, own]),
            np.hstack([self.columns(point, calibration) / each, no]),
        )
        self._add_distances(system, calibration)
        return system

    def _add_distances(self, system: NormalEquations, calibration: Calibration) -> None:
        """Contacts of one place are a known distance apart."""
        r, J = self.distances(calibration)
        system.C += J.T @ J
        system.g_p += J.T @ r
        system.cost += 0.5 * float(r @ r)

    def distances(self, calibration: Calibration) -> tuple[Array, Array]:
        """Whitened residuals of the known distances, shape (d,), and their derivatives, shape (d, p)."""
        setup = self.robot.poses
        assert setup is not None
        pairs = [] if setup.contact_distance is None else list(self.pairs.values())
        r, J = np.zeros(len(pairs)), np.zeros((len(pairs), calibration.size))
        for i, pair in enumerate(pairs):
            apart = calibration[contact_block(pair[0])] - calibration[contact_block(pair[1])]
            distance = float(np.linalg.norm(apart))
            along = apart / max(distance, 1e-12) / setup.target_sigma
            for contact, sign in zip(pair, (1.0, -1.0), strict=True):
                J[i, calibration.columns[contact_block(contact)]] = sign * along
            r[i] = (distance - (setup.contact_distance or 0.0)) / setup.target_sigma
        return r, J
