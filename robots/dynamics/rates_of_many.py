# SPDX-License-Identifier: BSD-3-Clause
"""dx/dt of many states side by side with fixed parameters: the equations of `ElasticJoints` without their derivatives.

Predictions evaluate it thousands of times for a few hundred states at once, so whatever does not change from one time
to the next is found when it is built. A test holds it against `ElasticJoints`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.joint_springs import JointSprings, Springs
from jointscope.robots.dynamics.motor_torques import MotorTorques
from jointscope.robots.dynamics.state_rates import linear_torques
from jointscope.robots.dynamics.transmission import Transmission, is_behind
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque
from jointscope.robots.model.joint_parameters import JointParameters
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import StructuredTree

Array = NDArray[np.float64]

SILENT = 1e-4  # of its torque with friction that is a sign: less than that is nothing


class RatesOfMany:
    """The motion of one robot with its present parameters.

    Args:
        robot: tree, drives, effects and parameters.
        sharpness: of the dry friction of all motors instead of the robot's [s/rad].

    Attributes:
        layout: of the states.
    """

    def __init__(self, robot: Robot, sharpness: float | None = None):
        robot.need_link_dynamics()
        self.layout = layout = robot.layout
        values = robot.values
        parameters, tree = JointParameters(robot), StructuredTree(robot)
        self._bodies, self._scale = tree.bodies(values), values.get(tree.coriolis_scale or "", 1.0)
        springs, motors = JointSprings(layout, parameters), MotorTorques(robot, parameters)
        self._linear = linear_torques(robot, parameters, springs, motors, values).T
        self._gain = motors.of_command(np.ones((1, robot.n)), values)[0]
        self._coulomb, self._sharpness = parameters.of(values, "coulomb_torque"), robot.friction_sharpness(values)
        if sharpness is not None:
            self._sharpness = np.full(robot.n, sharpness)
        self._friction = layout.velocities_at(robot.choices.friction_velocity)
        own = [robot.joints.index(joint) for joint in layout.motors]
        n, m = layout.n_link, layout.n_motor
        self._inertia, self._motors = parameters.of(values, "inertia")[own], slice(n, n + m)
        at_rest = springs.at(np.zeros((1, layout.size)), values)
        weight = CarriedWeight(robot)
        laws = [_LawOfMany(h, robot, at_rest, values, weight, sharpness) for h in robot.effects if _is_law(h)]
        for law in laws:
            self._linear = self._linear + law.linear
        self._laws = [law for law in laws if not (law.is_linear or law.is_silent)]
        self._dry = [law for law in self._laws if law.is_dry]
        self._weight = weight if any(law.needs_weight for law in self._laws) else None
        self._values = values

    def torque_of(self, u: Array) -> Array:
        """Torque of the motors for commands in their SI unit, shape (m, n) [N m]."""
        return self._gain * u

    def rates(self, x: Array, command_torque: Array) -> Array:
        """dx/dt.

        Args:
            x: states, shape (m, d).
            command_torque: of the motors, shape (m, n) [N m].

        Returns:
            Shape (m, d).
        """
        layout, tau = self.layout, self._torques(x, command_torque)
        n = layout.n_link
        rate = np.empty_like(x)
        rate[:, layout.positions] = x[:, layout.velocities]
        rate[:, layout.v_link] = self._acceleration(x[:, layout.q_link], x[:, layout.v_link], tau[:, :n])
        rate[:, layout.v_motor] = tau[:, self._motors] / self._inertia
        rate[:, layout.memory] = tau[:, n + layout.n_motor :]
        return rate

    def of_motors(self, x: Array, command_torque: Array | None = None) -> Array:
        """Accelerations of the motors, shape (m, n_motor), without the bodies; arguments as in `rates`."""
        command = np.zeros((1, len(self._gain))) if command_torque is None else command_torque
        return self._torques(x, command)[:, self._motors] / self._inertia

    def by_friction(self, x: Array) -> Array:
        """The part of `of_motors` that depends on the sharpness of friction, shape (m, n_motor)."""
        tau = np.zeros((len(x), self.layout.n_rates))
        self._add_dry(x, tau, self._dry)
        return tau[:, self._motors] / self._inertia

    def _torques(self, x: Array, command_torque: Array) -> Array:
        tau = x @ self._linear
        tau[:, self.layout.motor_row] += command_torque
        self._add_dry(x, tau, self._laws)
        return tau

    def _add_dry(self, x: Array, tau: Array, laws: Sequence[_LawOfMany]) -> None:
        """Adds dry friction and the torques of some laws."""
        tau[:, self.layout.motor_row] -= self._coulomb * np.tanh(self._sharpness * x[:, self._friction])
        load = None if self._weight is None else self._weight.torque(x, self._values)
        for law in laws:
            law.add(x, tau, load)

    def _acceleration(self, q: Array, v: Array, tau: Array) -> Array:
        """Of the links, with the share of the Coriolis terms that the model has, shape (m, n_link)."""
        moving = self._bodies.acceleration(q, v, tau)
        if self._scale == 1.0:
            return moving
        still = self._bodies.acceleration(q, np.zeros_like(v), tau)
        return still + self._scale * (moving - still)


class _LawOfMany:
    """The law of one effect with fixed parameters.

    Attributes:
        needs_weight: whether it asks for what its gear carries.
        is_linear: whether it is linear in the state, as viscous friction is.
        linear: its torques per state if it is linear, else zero, shape (d, r).
        is_dry: whether it depends on the sharpness of friction, where that is not the robot's.
        is_silent: whether nothing is left of it with a sharpness that is none.
    """

    def __init__(
        self,
        here: EffectAt,
        robot: Robot,
        springs: Springs,
        values: Mapping[str, float],
        weight: CarriedWeight,
        sharpness: float | None = None,
    ):
        layout, effect = robot.layout, here.effect
        self._layout, self._effect, self._p = layout, effect, here.own(values)
        transmission = Transmission.of(robot) if is_behind(here, robot) else None
        self._maps = None if transmission is None else transmission.maps(values)
        self._joint = j = robot.joints.index(here.owner) if here.owner in robot.joints else 0
        self._joints, self._springs, self._sharpness = robot.joints, springs, robot.friction_sharpness(values)
        if sharpness is not None and isinstance(effect, JointTorque) and effect.side == "motor":
            self._sharpness = np.full(robot.n, sharpness)
        self.needs_weight = self.is_dry = self.is_silent = False
        if isinstance(effect, JointTorque):
            link, motor = int(layout.joint_link[j]), int(layout.motor_row[j])
            rows = {"link": ((link, 1.0),), "motor": ((motor, 1.0),), "spring": ((link, -1.0), (motor, 1.0))}
            self._rows = rows[effect.side]
            self._memory = layout.memories.index(here.label) if effect.memory is not None else -1
            gap = effect.behind(robot.effects, here.owner)
            self._gap = tuple(values[name] for name in gap) or None
            self.needs_weight = weight.on(here.owner, effect, self._p) is not None
            if sharpness is not None and effect.side == "motor":
                self._compare(sharpness)
        self.linear = self._slopes()
        self.is_linear = bool(np.any(self.linear))

    def add(self, x: Array, tau: Array, load: Array | None) -> None:
        """Adds torques and rates of memories.

        Args:
            x: states, shape (m, d).
            tau: receives them, shape (m, r).
            load: torque of the weight that gears carry, shape (m, n) [N m]; None where no law needs it.
        """
        if self._maps is None:
            self._add(x, tau, load)
            return
        S, R = self._maps
        own = np.zeros_like(tau)
        self._add(x @ S.T, own, load)
        tau += own @ R.T

    def _add(self, x: Array, tau: Array, load: Array | None) -> None:
        effect, layout = self._effect, self._layout
        if isinstance(effect, RobotTorque):
            found = effect.law(self._of_robot(x), self._p)
            for rows, torque in zip((layout.joint_link, layout.motor_row), found, strict=True):
                for j, row in enumerate(rows.tolist()):
                    tau[:, row] += np.real(torque[:, j])
            return
        assert isinstance(effect, JointTorque)
        at = self._of_joint(x, load)
        value = np.real(effect.law(at, self._p))
        for row, sign in self._rows:
            tau[:, row] += sign * value
        if effect.memory is not None:
            tau[:, layout.n_link + layout.n_motor + self._memory] += np.real(effect.memory.rate(at, self._p))

    def _of_joint(self, x: Array, load: Array | None) -> JointSignals:
        j, layout, springs = self._joint, self._layout, self._springs
        q_link, v_link = x[:, layout.joint_q[j]], x[:, layout.joint_v[j]]
        q_motor, v_motor = x[:, layout.motor_q[j]], x[:, layout.motor_v[j]]
        tau: Any
        if self.needs_weight and load is not None:
            tau = load[:, j]
        else:
            tau = springs.stiffness[j] * (q_link - q_motor) + springs.damping[j] * (v_link - v_motor)
        memory = x[:, layout.memory.start + self._memory] if self._memory >= 0 else 0.0
        return JointSignals(
            q_link,
            v_link,
            q_motor,
            v_motor,
            tau,
            springs.stiffness[j],
            sharpness=float(self._sharpness[j]),
            memory=memory,
            gap=self._gap,
        )

    def _of_robot(self, x: Array) -> RobotSignals:
        layout = self._layout
        return RobotSignals(
            q_link=x[:, layout.joint_q],
            v_link=x[:, layout.joint_v],
            q_motor=x[:, layout.motor_q],
            v_motor=x[:, layout.motor_v],
            stiffness=self._springs.stiffness,
            damping=self._springs.damping,
            joints=self._joints,
            owner=self._joint,
            sharpness=self._sharpness,
        )

    def _compare(self, sharpness: float) -> None:
        """Finds out what the sharpness does to the law, at states of every size."""
        layout, of_friction = self._layout, self._sharpness
        rng, sizes = np.random.default_rng(2), 10.0 ** np.arange(-4.0, 4.0)[:, None]
        x, load = rng.normal(size=(8, layout.size)) * sizes, rng.normal(size=(8, len(self._joints))) * sizes
        found = np.zeros((2, 8, layout.n_rates))
        for torque, k in zip(found, (sharpness, 1.0 / sharpness), strict=True):
            self._sharpness = np.full(len(self._joints), k)
            self.add(x, torque, load)
        self._sharpness = of_friction
        own, other = np.abs(found)
        self.is_dry = not np.array_equal(*found)
        self.is_silent = bool(np.any(other)) and bool(np.all(own <= SILENT * other))

    def _slopes(self) -> Array:
        """Torques per unit of each state; zero for a law that is not linear."""
        layout = self._layout
        found = np.zeros((layout.size, layout.n_rates))
        if self.needs_weight:
            return found
        self.add(np.eye(layout.size), found, None)
        x = np.random.default_rng(1).normal(size=(8, layout.size)) * 10.0 ** np.arange(-4.0, 4.0)[:, None]
        torque = np.zeros((8, layout.n_rates))
        self.add(x, torque, None)
        exact = 1e-12 * (np.abs(x) @ np.abs(found)) + 1e-300
        return found if np.all(np.abs(torque - x @ found) <= exact) else np.zeros_like(found)


def _is_law(here: EffectAt) -> bool:
    return isinstance(here.effect, JointTorque | RobotTorque)
