# SPDX-License-Identifier: BSD-3-Clause
"""An arm in MuJoCo whose motors are shaken while they follow a slow sine; all other joints are welded.

Every shaken joint is a hinge with two more for its bearing and a rotor of its own in the world, tied to the hinge by a
tendon that is the drive's spring. The engine integrates all of it in time; nothing is linearised. Gaps, hardening
springs and wavy gears are what they pull more than that spring.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.simulator.arm.arm_bodies import ArmBodies
from jointscope.tools.simulator.arm.pose_effects import PoseEffect
from jointscope.tools.simulator.loop.controller import effort_limits
from jointscope.tools.simulator.loop.shaker import SERVO
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.specification import (
    add_dry_friction,
    add_light_body,
    add_tendon,
    motor_joint,
    set_linear,
    spring_tendon,
)

Array = NDArray[np.float64]
STEP = 5e-4  # [s] of the integration, fourth order
ROUNDS = 6  # of the equilibrium at which an experiment begins
WRIST_LOSS = 2e-4  # [s] damping over stiffness of a locked joint that gives way


class ShakenArm:
    """A compiled arm in one pose.

    Args:
        robot: with a section `frequency`.
        values: true values by full name.
        effects: what is wrong with it.
        pose: angles of all joints, shape (n,) [rad].
        friction: "smooth" for tanh(sharpness v), "dry" for the engine's own friction loss.
    """

    def __init__(
        self, robot: Robot, values: Mapping[str, float], effects: Iterable[PoseEffect], pose: Array, friction: str
    ):
        assert robot.frequency is not None
        self._mujoco, self._robot, self.joints = load_mujoco(), robot, robot.frequency.joints
        self._values, self._bodies = values, ArmBodies(robot, values, effects)
        self._pose = dict(zip(robot.joints, pose.tolist(), strict=True))
        self._model = self._built(friction).compile()
        self._data = self._mujoco.MjData(self._model)
        self._motors = self._places(motor_joint)
        self._links = self._places(lambda joint: joint)
        self._smooth = self._each("coulomb_torque") * (friction == "smooth")
        self._sharpness = np.array([robot.sharpness_of(joint, values) for joint in self.joints])
        self._k = np.array([1.0 / self._bodies.compliance(joint) for joint in self.joints])
        self._damping = self._each("damping")
        self._size = {
            part: np.array([self._bodies.size(effect, joint, part) for joint in self.joints])
            for effect, part in (
                ("backlash", "half_gap"),
                ("spring_cubic", "stiffness"),
                ("gear_ripple", "amplitude"),
                ("gear_ripple", "order"),
                ("gear_ripple", "phase"),
                ("motor_stribeck", "torque"),
                ("motor_stribeck", "velocity"),
                ("load_dependent_friction", "coefficient"),
            )
        }
        self._size["half_gap"] -= self._each("backlash")
        odd = self._size["half_gap"], self._size["stiffness"], self._size["amplitude"]
        self._linear = not any(np.any(part) for part in odd)
        self._plain = not np.any(self._size["torque"]) and not np.any(self._size["coefficient"])

    @property
    def inertias(self) -> Array:
        """What each motor moves with the others standing, shape (n,) [kg m2]."""
        self._at_rest()
        found = np.zeros(len(self.joints))
        for i, places in enumerate(zip(self._links, self._motors, strict=True)):
            for place in places:
                column = np.zeros(self._model.nv)
                self._mujoco.mj_mulM(self._model, self._data, column, np.eye(self._model.nv)[place])
                found[i] += column[place]
        return found

    @property
    def left(self) -> Array:
        """Torque of each drive beside the weight, shape (n,) [N m]; infinite where the URDF does not limit it.

        Raises:
            SimulationError: the weight is more.
        """
        places = [self._robot.joints.index(joint) for joint in self.joints]
        left = effort_limits(self._robot)[places] - np.abs(self._at_rest())
        if np.any(left <= 0.0):
            joint = self.joints[int(np.argmin(left))]
            raise SimulationError(
                f"{joint} of {self._robot.name} cannot hold the weight in a pose; name another --pose"
            )
        return left

    def shaken(self, torque: Array, swing: float, speed: float, settle: int, periods: int, every: int) -> Array:
        """Angles and torques of the motors while they are shaken.

        Args:
            torque: one period of the excitation at half steps of the integration, shape (m, n) [N m].
            swing: amplitude of the slow sine [rad].
            speed: of it [rad/s].
            settle: periods before those that are kept.
            periods: that are kept.
            every: steps of the integration from sample to sample.

        Returns:
            Shape (2, samples, n): [rad], [N m].

        Raises:
            SimulationError: the integration breaks down.
        """
        inertia, hold = self.inertias, self._at_rest()
        stiff = inertia * (SERVO) ** 2
        damp = 2.0 * inertia * SERVO
        t = 0.5 * STEP * np.arange((settle + periods) * len(torque) + 1)
        wave, rate = swing * np.sin(speed * t)[:, None], swing * speed * np.cos(speed * t)[:, None]
        middle = np.array([self._pose[joint] for joint in self.joints])
        ahead = hold - inertia * speed**2 * wave + damp * rate + stiff * (middle + wave)
        ahead += np.resize(torque, (len(t), torque.shape[1]))
        data, v0 = self._data, np.full(len(self.joints), swing * speed)
        data.time = 0.0
        data.qvel[self._motors], data.qvel[self._links] = v0, v0
        qpos, qvel, passive = data.qpos, data.qvel, data.qfrc_passive
        motors, links = self._motors, self._links

        def drive(q: Array, v: Array) -> Array:
            return np.asarray(ahead[round(data.time / (0.5 * STEP))] - stiff * q - damp * v)

        def push(model: Any, _: Any) -> None:
            q, v = qpos[motors], qvel[motors]
            dry = self._smooth if self._plain else self._dry(qpos[links] - q, qvel[links] - v, v)
            passive[motors] += drive(q, v) - dry * np.tanh(self._sharpness * v)
            if not self._linear:
                pull, felt = self._more_pull(qpos[links] - q, qvel[links] - v, q, v)
                passive[links] += pull
                passive[motors] -= felt

        found = []
        samples = periods * len(torque) // (2 * every)
        try:
            self._mujoco.set_mjcb_passive(push)
            self._mujoco.mj_step(self._model, data, settle * len(torque) // 2)
            for _ in range(samples):
                q = qpos[motors].copy()
                found.append((q, drive(q, qvel[motors])))
                self._mujoco.mj_step(self._model, data, every)
        finally:
            self._mujoco.set_mjcb_passive(None)
        kinds = self._mujoco.mjtWarning
        bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        if any(data.warning[int(kind)].number for kind in bad):
            raise SimulationError(
                f"the engine cannot follow this arm in steps of {1e3 * STEP:g} ms; a spring is too stiff for what "
                "hangs on it, or a damper too strong"
            )
        return np.swapaxes(np.array(found), 0, 1)

    def _dry(self, d: Array, rate: Array, v: Array) -> Array:
        """How large dry friction is where it breaks away and grows with what the drive passes on, shape (n,) [N m]."""
        part = self._size
        slow = np.where(part["torque"] != 0.0, v / np.where(part["velocity"] > 0.0, part["velocity"], 1.0), 0.0)
        passed = np.abs(self._k * d + self._damping * rate)
        return np.asarray(self._smooth + part["torque"] * np.exp(-(slow**2)) + part["coefficient"] * passed)

    def _more_pull(self, d: Array, rate: Array, q: Array, v: Array) -> tuple[Array, Array]:
        """Torque on the links beyond that of linear springs and dampers, and what the motors feel beyond it.

        A wavy gear turns the link by q + off(q), so its power balance levers all that the drive passes on by 1 + off'.

        Args:
            d: links over motors [rad].
            rate: of it [rad/s].
            q: of the motors [rad].
            v: of the motors [rad/s].
        """
        part = self._size
        wave = part["order"] * q + part["phase"]
        off, slope = part["amplitude"] * np.cos(wave), -part["amplitude"] * part["order"] * np.sin(wave)
        apart = d - off
        gap = np.abs(part["half_gap"]) * np.sign(apart)
        taken = np.where(np.abs(apart) < np.abs(gap), 0.0, apart - gap)
        plain = -self._k * d - self._damping * rate
        passed = -self._k * taken - part["stiffness"] * taken**3 - self._damping * (rate - slope * v)
        return passed - plain, passed * (1.0 + slope) - plain

    def _at_rest(self) -> Array:
        """Puts the arm where it hangs in its springs, and returns what its motors hold, shape (n,) [N m]."""
        data, model = self._data, self._model
        data.qpos[:], data.qvel[:] = 0.0, 0.0
        for joint, m, q in zip(self.joints, self._motors, self._links, strict=True):
            data.qpos[[m, q]] = self._pose[joint]
        for _ in range(ROUNDS):
            self._mujoco.mj_forward(model, data)
            pull = -data.qfrc_bias.copy()
            for i, (m, q) in enumerate(zip(self._motors, self._links, strict=True)):
                data.qpos[q] = data.qpos[m] + pull[q] / self._k[i]
            for place, k in self._springs.items():
                data.qpos[place] = pull[place] / k
        self._mujoco.mj_forward(model, data)
        return np.asarray(data.qfrc_bias[self._links].copy())

    def _built(self, friction: str) -> Any:
        mujoco, spec = self._mujoco, self._mujoco.MjSpec()
        spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_RK4, STEP
        spec.option.gravity = self._robot.tree.gravity
        spec.compiler.balanceinertia = False
        hinge, bodies = mujoco.mjtJoint.mjJNT_HINGE, self._bodies
        soft = [j for j in self._robot.joints if j not in self.joints and bodies.compliance(j) > 0.0]
        locked = {joint: q for joint, q in self._pose.items() if joint not in self.joints}
        found = bodies.add_to(spec, locked, soft)
        for joint, (body, axes) in found.items():
            body.add_joint(name=joint, type=hinge, axis=axes[""])
            for axis in "yx":
                if bodies.tilt_compliance(joint, axis) > 0.0:
                    about = body.add_joint(name=f"{joint}.{axis}", type=hinge, axis=axes[f".{axis}"])
                    loss = bodies.value(joint, f"bearing.damping_{axis}")
                    _tie(about, 1.0 / bodies.tilt_compliance(joint, axis), loss)
        for joint in soft:
            lock = spec.joint(joint)
            _tie(lock, 1.0 / bodies.compliance(joint), WRIST_LOSS / bodies.compliance(joint))
        for joint in self.joints:
            rotor = add_light_body(spec, motor_joint(joint), bodies.value(joint, "inertia"))
            turning = rotor.add_joint(name=motor_joint(joint), type=hinge, axis=[0.0, 0.0, 1.0])
            set_linear(turning, "damping", bodies.value(joint, "motor_viscous.coefficient"))
            if friction == "dry":
                add_dry_friction(turning, bodies.value(joint, "coulomb_torque"))
            tendon = add_tendon(spec, spring_tendon(joint), joint, {joint: 1.0})
            set_linear(tendon, "stiffness", 1.0 / bodies.compliance(joint))
            set_linear(tendon, "damping", bodies.value(joint, "damping"))
        return spec

    @property
    def _springs(self) -> dict[int, float]:
        """Stiffness of every hinge that has a spring of its own, by its place."""
        model = self._model
        stiffness = np.reshape(model.jnt_stiffness, (model.njnt, -1))[:, 0]
        return {int(model.jnt_qposadr[i]): float(k) for i, k in enumerate(stiffness) if k > 0.0}

    def _places(self, name: Any) -> Array:
        return np.array([int(self._model.joint(name(joint)).qposadr[0]) for joint in self.joints])

    def _each(self, part: str) -> Array:
        return np.array([self._bodies.value(joint, part) for joint in self.joints])


def _tie(hinge: Any, stiffness: float, damping: float) -> None:
    set_linear(hinge, "stiffness", stiffness)
    set_linear(hinge, "damping", damping)
