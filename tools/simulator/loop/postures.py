# SPDX-License-Identifier: BSD-3-Clause
"""Postures in which a robot is brought to rest, drawn so that its drives hold it there with all weights.

A posture is where links would be with nothing hung on them. Each joint comes to it from a side that is drawn, however
it has to go there first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.known_loads import known_loads
from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.loop.controller import drive_gains, effort_limits, full_command
from jointscope.tools.simulator.world.specification import is_rigid, transmission

Array = NDArray[np.float64]
REACH, LARGEST = 0.75, 2.0  # share of each joint's range that postures fill, but at most [rad or m] to either side
RUN = 0.2  # of that, from which a joint comes to its posture
LIKE = 0.9  # of what drives give, that holding may take
BENT = 0.5  # of what postures fill, by which weights may move a link on its spring
LEAST, LONGER = 0.8, 0.8  # [s] of a move, and what one by half of all postures takes more
CALMLY = 3.0  # periods of the slowest swing that a move, or a hand with a weight, takes at least
PEAK = 1.875  # largest speed of a minimum-jerk move over its mean
SPEED = 0.5  # of what the URDF allows
TRIES = 400  # for one posture


@dataclass(frozen=True)
class Posture:
    """Where a robot is to rest.

    Attributes:
        q: positions of the links with nothing hung on them, shape (n,) [rad or m].
        before: from where they come, shape (n,) [rad or m].
    """

    q: Array
    before: Array


class Holding:
    """What holds a robot in any posture: torques of its motors, and where these stand.

    Args:
        robot: with its true parameters.

    Attributes:
        robot: the same.
        T: joint angles per motor angle while no spring is stretched, shape (n, n).
        centre, half: middle of the postures, and how far they go to either side, shape (n,) [rad or m].
        run: from which a joint comes to its posture, shape (n,) [rad or m].
        inertia: what each motor moves with the others standing, in the middle, shape (n,) [kg m2 or kg].
        dry: friction of each, shape (n,) [N m or N].
        gains: torque per unit of the command, shape (n,).
        most: torques that the drives can give, shape (n,); infinite where the URDF does not say.
        period: of the slowest swing of links on their springs, in the middle [s]; 0 where all joints are rigid.
    """

    def __init__(self, robot: Robot):
        low, high = robot.tree.limits.T
        bounded = np.isfinite(low) & np.isfinite(high) & (high - low < 1e3)
        half = np.where(bounded, REACH * (high - low) / 2.0, np.pi / 2.0)
        self.robot, self.T = robot, transmission(robot)
        self.half = np.minimum(half, LARGEST)
        self.centre = np.where(bounded, (high + low) / 2.0, 0.0)
        self.run = RUN * self.half
        rotors = np.array([robot.drive_parameter(joint, "inertia").value for joint in robot.joints])
        self.inertia = np.diagonal(self.T.T @ robot.tree.mass_matrix(self.centre[None])[0] @ self.T) + rotors
        self.dry = np.array([robot.parameter(f"{joint}.coulomb_torque").value for joint in robot.joints])
        self.gains = drive_gains(robot)
        by_volts = robot.command.unit in ("duty", "V")
        self.most = full_command(robot) * np.abs(self.gains) if by_volts else effort_limits(robot)
        self.period = _slowest_swing(robot, self.T, self.centre)
        self._compliance = np.array(
            [0.0 if is_rigid(robot, j) else 1.0 / robot.parameter(f"{j}.stiffness").value for j in robot.joints]
        )

    def torques(self, q: Array) -> Array:
        """That motors need to hold the weight of the links alone, shape (n,) [N m]."""
        still = np.zeros((1, len(q)))
        return np.asarray(self.T.T @ self.robot.tree.torque(q[None], still, still)[0])

    def loads(self, q: Array, force: Array, at: str) -> Array:
        """The same for a force on a link, shape (n,) [N m]."""
        return np.asarray(-self.T.T @ known_loads(self.robot.tree, [at], force[None], q[None]).torque[0])

    def motors(self, q: Array) -> Array:
        """Positions of the motors at which links are in equilibrium there, if springs are straight, shape (n,)."""
        return np.asarray(np.linalg.solve(self.T, q) + self._compliance * self.torques(q))

    def sag(self, torque: Array) -> Array:
        """How far links move on their springs if motors stand and a load comes that takes these torques, shape (n,)."""
        return np.asarray(-self.T @ (self._compliance * torque))

    def duration(self, a: Array, b: Array) -> float:
        """Of a move of all links together from one posture, shape (n,), to another; 0 if they are the same [s]."""
        way, speed = np.abs(b - a), self.robot.tree.velocity_limits
        if not np.any(way):
            return 0.0
        fastest = SPEED * np.where(np.isfinite(speed) & (speed > 0.0) & (speed < 1e3), speed, np.inf)
        least = max(LEAST, CALMLY * self.period)
        return float(max(least + LONGER * np.max(way / self.half), PEAK * np.max(way / fastest)))


def _slowest_swing(robot: Robot, T: Array, q: Array) -> float:
    """Period of links on their springs while motors stand [s]; a rigid joint stands, too."""
    soft = [i for i, joint in enumerate(robot.joints) if not is_rigid(robot, joint)]
    if not soft:
        return 0.0
    stiffness = np.diag([robot.parameter(f"{robot.joints[i]}.stiffness").value for i in soft])
    unstretched = np.linalg.inv(T[np.ix_(soft, soft)])
    mass = robot.tree.mass_matrix(q[None])[0][np.ix_(soft, soft)]
    compliant = np.linalg.solve(unstretched.T @ stiffness @ unstretched, mass)
    return float(2.0 * np.pi * np.sqrt(np.abs(np.linalg.eigvals(compliant)).max()))


def ways(postures: Sequence[Posture]) -> Iterator[tuple[Array, Array]]:
    """The moves through all postures, from the place where the first one is come from."""
    last = postures[0].before
    for posture in postures:
        yield last, posture.before
        yield posture.before, posture.q
        last = posture.q


def drawn_postures(
    holding: Holding, count: int, forces: Sequence[Array], at: str, rng: np.random.Generator
) -> list[Posture]:
    """Postures that drives can hold.

    Args:
        holding: of the robot.
        count: number of postures.
        forces: that will hang on the arm, shape (3,) each [N].
        at: link that they act on.
        rng: draws them.

    Raises:
        SimulationError: the drives cannot hold the arm with the heaviest weight anywhere.
    """
    robot, most = holding.robot, LIKE * holding.most
    found, tried = list[Posture](), 0
    while tried < TRIES:
        tried += 1
        q = holding.centre + holding.half * rng.uniform(-1.0, 1.0, robot.n)
        side = rng.choice([-1.0, 1.0], robot.n)
        before = q - side * holding.run
        weight = holding.torques(q)
        loads = [holding.loads(q, force, at) for force in forces]
        if all(np.all(np.abs(weight + load) + holding.dry < most) for load in loads) and all(
            np.all(np.abs(holding.sag(load)) < BENT * holding.half) for load in loads
        ):
            found.append(Posture(q, before))
            tried = 0
        if len(found) == count:
            return found
    heaviest = max(float(np.linalg.norm(force)) for force in forces)
    raise SimulationError(
        f"drives and springs of {robot.name} hold {heaviest:.3g} N at {at} in {len(found)} postures that were "
        f"found, expected {count}; give lighter --weights, another --at, or a smaller --count"
    )
