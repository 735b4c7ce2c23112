# SPDX-License-Identifier: BSD-3-Clause
"""All bodies and joints of a URDF, and the model that is left when only some of the joints move.

The others are locked: their bodies become one with the body before them. What moves has one coordinate per joint:
continuous joints are revolute ones without limits, mimic joints have a coordinate here that `Coupling` ties to the
joint they follow. Names of links and joints may coincide.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pinocchio as pin

from jointscope.robots.errors import RobotError
from jointscope.robots.urdf.mimic_joints import Follower, followers_of
from jointscope.robots.urdf.motion_axis import motion_axis
from jointscope.robots.urdf.urdf_parser import parse_urdf
from jointscope.robots.urdf.urdf_text import UrdfText

ROUND = {"JointModelRUBX": pin.JointModelRX, "JointModelRUBY": pin.JointModelRY, "JointModelRUBZ": pin.JointModelRZ}
ROUND_SLANTED = "JointModelRevoluteUnboundedUnaligned"


@dataclass(frozen=True)
class UrdfBodies:
    """A URDF as pinocchio reads it.

    Attributes:
        path: the file.
        model: all joints; those with <mimic> as if they moved freely, continuous ones with two coordinates.
        followers: the mimic joints among them.
        complaints: what the parser left out, and why.
    """

    path: Path
    model: pin.Model
    followers: Mapping[str, Follower]
    complaints: tuple[str, ...] = ()

    @staticmethod
    def read(path: Path) -> UrdfBodies:
        """Reads a URDF.

        Raises:
            RobotError: no such file, no URDF, or one with macros of xacro.
        """
        if not path.is_file():
            raise RobotError(f"the URDF {path} does not exist; set `urdf` in the robot file, relative to that file")
        text = UrdfText(path)
        if text.macro:
            expanded = path.with_name(f"{path.name.partition('.')[0]}_expanded.urdf")
            raise RobotError(
                f"{path} is a xacro file ({text.macro}), expected a URDF without macros: xacro {path} > {expanded} "
                "(from ROS, or pip install xacro)"
            )
        if text.unread and not text.trouble:
            raise RobotError(f"{path}, {text.unread}; expected a decimal number with a point, as 1.6")
        model, complaints = parse_urdf(path, text)
        complaints += tuple(f"link {link} has an inertia but mass 0, as no body has" for link in text.weightless)
        names = set(model.names)
        followers = {name: follower for name, follower in followers_of(text, path.name).items() if name in names}
        lost = [name for name in text.mimics if name in names and name not in followers]
        complaints += tuple(
            f"joint {name} mimics {text.mimics[name].get('joint', '')!r}, which is no joint of the file, and is taken "
            "for a joint of its own"
            for name in lost
        )
        return UrdfBodies(path, model, followers, complaints)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all joints that are not fixed, base to tip."""
        return tuple(self.model.names)[1:]  # the first one is the universe

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Names of the joints with one axis that follow no other joint, base to tip."""
        return tuple(name for name in self.names if name not in self.followers and self._joint(name).nv == 1)

    def moved_by(self, joints: Collection[str]) -> tuple[str, ...]:
        """These joints and those that follow them, base to tip."""
        led = {name for name, follower in self.followers.items() if follower.leader in joints and follower.factor != 0}
        return tuple(name for name in self.names if name in joints or name in led)

    def that_matter(self, joints: Collection[str]) -> tuple[str, ...]:
        """Free joints beside `joints` whose position changes the equations of `joints`.

        They carry one of `joints` or are carried by it, themselves or by what follows them; on a fixed base, what
        stands on another branch does not matter.
        """
        moved = {self.model.getJointId(name) for name in self.moved_by(joints)}
        carried = {j for j in range(1, self.model.njoints) if moved & set(self._supports(j))}
        carrying = {support for j in moved for support in self._supports(j)}
        near = {self.model.names[j] for j in carried | carrying}
        return tuple(name for name in self.free if name not in joints and near & set(self.moved_by([name])))

    def reduced(self, joints: Collection[str], locked: Mapping[str, float]) -> pin.Model:
        """The model in which only `joints` and what follows them move, the others locked.

        Args:
            joints: names of joints that follow no other.
            locked: positions of other free joints [rad] or [m]; zero where none is given.
        """
        full, moving = self.model, self.moved_by(joints)
        data = full.createData()
        pin.forwardKinematics(full, data, self._configuration(locked))
        model = pin.Model()
        model.name = full.name
        # joint of the new model that carries a joint of the full one, and the latter's placement on it
        carriers, placements = [0], [pin.SE3.Identity()]
        for j in range(1, full.njoints):
            name, before = full.names[j], full.parents[j]
            if name in moving:
                placement = placements[before] * full.jointPlacements[j]
                carriers.append(self._add(model, carriers[before], placement, name))
                placements.append(pin.SE3.Identity())
            else:
                carriers.append(carriers[before])
                placements.append(placements[before] * data.liMi[j])
            if full.inertias[j].mass or full.inertias[j].inertia.any():
                model.appendBodyToJoint(carriers[j], full.inertias[j], placements[j])
        for frame in list(full.frames)[1:]:
            if frame.type == pin.FrameType.BODY:
                j = frame.parentJoint
                placed = pin.Frame(frame.name, carriers[j], 0, placements[j] * frame.placement, frame.type)
                model.addFrame(placed, False)
        return model

    def leading(self, positions: Mapping[str, float]) -> dict[str, float]:
        """Positions with those of joints that only show in what follows them."""
        found = dict(positions)
        for name, follower in self.followers.items():
            if name in positions and follower.factor != 0.0:
                found.setdefault(follower.leader, (positions[name] - follower.offset) / follower.factor)
        return found

    def is_slide(self, joint: str) -> bool:
        """Whether a joint is prismatic."""
        return joint in self.names and self._joint(joint).shortname().startswith("JointModelP")

    def limits(self, joint: str) -> tuple[float, float]:
        """Lower and upper limit of a joint with one axis; both infinite for a continuous one."""
        q = self._joint(joint).idx_q
        if self._joint(joint).nq == 2:
            return -np.inf, np.inf
        return float(self.model.lowerPositionLimit[q]), float(self.model.upperPositionLimit[q])

    def has_axis(self, joint: str) -> bool:
        """Whether the axis of a joint has a direction."""
        return bool(np.linalg.norm(motion_axis(self._joint(joint))) > 0.5)

    def _joint(self, name: str) -> pin.JointModel:
        return self.model.joints[self.model.getJointId(name)]

    def _supports(self, j: int) -> Iterator[int]:
        """A joint and all before it, down to the base."""
        while j > 0:
            yield j
            j = self.model.parents[j]

    def _configuration(self, locked: Mapping[str, float]) -> np.ndarray:
        """Coordinates in pinocchio of all joints, where free ones are at `locked` or zero."""
        q = pin.neutral(self.model)
        for name in self.names:
            joint, follower = self._joint(name), self.followers.get(name)
            if joint.nv != 1:
                continue
            at = locked.get(name, 0.0) if follower is None else follower.position(locked.get(follower.leader, 0.0))
            q[joint.idx_q : joint.idx_q + joint.nq] = at if joint.nq == 1 else (np.cos(at), np.sin(at))
        return q

    def _add(self, model: pin.Model, parent: int, placement: pin.SE3, name: str) -> int:
        joint, full = self._joint(name), self.model
        kind, lower, upper = joint, full.lowerPositionLimit, full.upperPositionLimit
        limits = lower[joint.idx_q, None], upper[joint.idx_q, None]
        if joint.nq == 2:
            kind, limits = self._revolute(joint), (np.array([-np.inf]), np.array([np.inf]))
        effort, velocity = full.effortLimit[joint.idx_v, None], full.velocityLimit[joint.idx_v, None]
        return model.addJoint(parent, kind, placement, name, effort, velocity, *limits)

    def _revolute(self, joint: pin.JointModel) -> pin.JointModel:
        """A continuous joint as one with a single coordinate."""
        if joint.shortname() != ROUND_SLANTED:
            return ROUND[joint.shortname()]()
        return pin.JointModelRevoluteUnaligned(motion_axis(joint)[3:])
