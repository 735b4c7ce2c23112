# SPDX-License-Identifier: BSD-3-Clause
"""Something at the tip that the model does not know: turned about the last joint, or weighed at a known target.

Where the robot file says which point of the tool is measured in poses, a load there is a mass at that point, in motion
as in poses and in frequency responses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect, about_origin

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.robot_view import RobotView

Array = NDArray[np.float64]
ROBOT = "robot"


def change(body: Array) -> dict[str, Array]:
    """A point mass on the long axis n: m l^2 (1 - n n^T), per m l^2.

    Args:
        body: its ten dynamic parameters, shape (10,).

    Returns:
        Change of the ten dynamic parameters, shape (10,).
    """
    n = np.linalg.eigh(about_origin(body))[1][:, 0]
    xx, xy, xz, yy, yz, zz = (np.eye(3) - np.outer(n, n))[np.triu_indices(3)]
    return {"inertia": np.array([0.0, 0.0, 0.0, 0.0, xx, xy, yy, xz, yz, zz])}


@dataclass(frozen=True, kw_only=True)
class Payload(InertiaEffect):
    """Of the last joint, and of a robot whose file says where the target of its poses is."""

    mass: EffectParameter

    def owners_of(self, robot: RobotView) -> tuple[str, ...]:
        """The last joint; the robot, where a joint with an equation of its own carries the target."""
        carried = robot.poses is not None and self.joint_of(robot, ROBOT) in robot.joints
        return (*super().owners_of(robot), *((ROBOT,) if carried else ()))

    def parameters_of(self, robot: RobotView, owner: str) -> tuple[EffectParameter, ...]:
        """A mass where the place is known, else mass times the square of a length."""
        return (self.mass,) if owner == ROBOT else self.parameters

    def joint_of(self, robot: RobotView, owner: str) -> str:
        """The joint that carries the load."""
        if owner != ROBOT or robot.poses is None:
            return owner
        model = robot.tree.model
        return str(model.names[model.frames[robot.tree.frame_id(robot.poses.link)].parentJoint])

    def change_at(self, robot: RobotView, owner: str, body: Array) -> dict[str, Array]:
        """Of a kilogramme at the target, or as `change`."""
        if owner != ROBOT or robot.poses is None:
            return self.change(body)
        placement = robot.tree.model.frames[robot.tree.frame_id(robot.poses.link)].placement
        p = np.array(placement.act(robot.poses.at))
        xx, xy, xz, yy, yz, zz = (p @ p * np.eye(3) - np.outer(p, p))[np.triu_indices(3)]
        return {self.mass.name: np.array([1.0, *p, xx, xy, yy, xz, yz, zz])}


EFFECT = Payload(
    id="payload",
    turning=True,
    change=change,
    last_only=True,
    parameters=(EffectParameter("inertia", "kg m2", start=0.01, prior_sigma=10.0, sign="+"),),
    mass=EffectParameter("mass", "kg", start=0.1, prior_sigma=10.0, sign="+"),
    example={"inertia": 0.05},
    card=Card(
        title="unknown load at the tip",
        law="I = I_model + J (1 - n n^T), with J = inertia = m l^2 of a point mass on the long axis n of the last "
        "body, the axis of its least inertia; of the robot, where its file has a section `poses`, a point of "
        "a mass at the first target",
        explanation="A tool, a camera or a costume at the end of the last body adds inertia about both axes across. "
        "Its weight is not part of it where its place is not known: where gravity acts, gravity_imbalance finds that.",
        source="Swevers, Verdonck, De Schutter (2007), Dynamic model identification for industrial robots, IEEE "
        "Control Systems Magazine 27(5)",
        typical="1 to 50 % of the last body's own inertia",
        excitation="acceleration of all joints that move the last body, in several postures",
        look_alikes={
            "torque_constant_error": "where rotors' inertias are not known, a load scales torques as a drive does",
            "link_mass": "a load that is always there is a mass of the link that carries it",
            "inertia_error": "a payload is one combination of errors of the last body's moments of inertia",
        },
    ),
)
