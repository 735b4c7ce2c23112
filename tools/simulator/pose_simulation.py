# SPDX-License-Identifier: BSD-3-Clause
"""Poses of an arm in MuJoCo: bodies where the errors put them, hinges that give way under the engine's own gravity.

Every joint is a hinge, and behind it in the same body two more for its bearing, which turn with the arm. The arm rests
where the torque of each spring is that which the engine asks for to hold it (`qfrc_bias` of a robot that stands).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError, SimulationError
from jointscope.robots.geometry.error_parameters import error_names, is_length
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.tools.simulator.pose_effects import PoseEffect, pose_effects
from jointscope.tools.simulator.world.inertia import full_inertia
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.random_streams import random_stream
from jointscope.tools.simulator.world.specification import joint_axis, quaternion_wxyz

Array = NDArray[np.float64]
LENGTH, ANGLE = 2.5e-4, 5e-4  # [m], [rad] 1 sigma of the errors that are drawn
VARIATION = 0.2  # of stiffnesses about those of the robot file, 1 sigma of the logarithm
ENCODER = 1e-6  # [rad]
REACH = 0.7  # share of each joint's range that poses fill
ROUNDS = 6  # of the equilibrium; each is a thousand times nearer


@dataclass(frozen=True)
class PoseConditions:
    """What is true of an arm.

    Attributes:
        values: of parameters by full name, where they shall not be drawn.
        effects: texts ID@OWNER[:param=value,...].
        perfect: no geometric errors but those in `values`.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    effects: Iterable[str] = ()
    perfect: bool = False


def simulate_poses(
    robot: Robot, count: int, seed: int = 0, conditions: PoseConditions | None = None, session: str = "poses"
) -> tuple[Poses, dict[str, Any]]:
    """Simulates poses with a tracker.

    Args:
        robot: with a section `poses`.
        count: number of poses.
        seed: of the arm; the same seed is the same arm.
        conditions: what is true of it.
        session: another one has other poses of the same arm.

    Returns:
        The poses and the truth, fit for JSON.

    Raises:
        RobotError: the robot file does not say what is measured of a pose.
        SimulationError: MuJoCo is missing, or no poses were asked for.
        EffectError: an unknown effect.
    """
    conditions = conditions or PoseConditions()
    if robot.poses is None:
        raise RobotError(f"{robot.path.name} has no section `poses`; see docs/poses.md")
    if count < 1:
        raise SimulationError(f"number of poses: expected 1 or more, got {count}")
    values = _true_values(robot, seed, conditions)
    effects = pose_effects(conditions.effects, robot.joints)
    arm, rng = _Arm(robot, values, effects), random_stream(seed, session)
    low, high = np.nan_to_num(robot.tree.limits.T, posinf=np.pi, neginf=-np.pi)
    middle, half = (low + high) / 2.0, np.minimum((high - low) / 2.0, np.pi)
    q = middle + REACH * half * rng.uniform(-1.0, 1.0, (count, robot.n))
    unseen = robot.poses.joint_sigmas * rng.standard_normal(q.shape)
    targets, torques = arm.at_rest(q, unseen)
    T = np.eye(4) if robot.poses.tracker is None else robot.poses.tracker
    shift = np.array([values.get(f"tracker.{part}", 0.0) for part in ("lx", "ly", "lz")])
    drift = np.linspace(0.0, 1.0, count)[:, None] * arm.drift
    noise = robot.poses.target_sigma * rng.standard_normal(targets.shape)
    measured = (targets - T[:3, 3]) @ T[:3, :3] + shift + drift + noise
    read = q + ENCODER * rng.standard_normal(q.shape)
    truth = {
        "robot": robot.name,
        "seed": seed,
        "session": session,
        "parameters": values,
        "effects": [{"effect": e.id, "owner": e.owner, "parameters": dict(e.parameters)} for e in effects],
        "targets": targets.tolist(),
    }
    names = tuple(map(str, range(count)))
    return Poses("simulation", "", names, read, measured, torque=torques), truth


def _true_values(robot: Robot, seed: int, conditions: PoseConditions) -> dict[str, float]:
    unknown = next((name for name in conditions.values if name not in robot.parameters), None)
    if unknown:
        raise RobotError(f"robot {robot.name!r} has no parameter {unknown!r}")
    rng, values = random_stream(seed, "arm"), {}
    for name in error_names(robot.joints):
        size = (LENGTH if is_length(name) else ANGLE) * rng.standard_normal()
        values[name] = 0.0 if conditions.perfect else float(size)
    for name, parameter in robot.parameters.items():
        if name not in values:
            drawn = parameter.prior * float(np.exp(VARIATION * rng.standard_normal()))
            values[name] = drawn if parameter.positive else parameter.prior
    return {**values, **conditions.values}


class _Arm:
    """A compiled model and the springs of its hinges."""

    def __init__(self, robot: Robot, values: Mapping[str, float], effects: Iterable[PoseEffect]):
        self._mujoco, self._robot, self._values = load_mujoco(), robot, values
        self._of = {(effect.id, effect.owner): effect.parameters for effect in effects}
        drift = self._of.get(("tracker_drift", "robot"), {})
        self.drift = np.array([drift.get(axis, 0.0) for axis in "xyz"])
        self._model = self._built().compile()
        self._data = self._mujoco.MjData(self._model)
        self._places = {
            self._model.joint(i).name: int(self._model.joint(i).qposadr[0]) for i in range(self._model.njnt)
        }

    def at_rest(self, motors: Array, unseen: Array) -> tuple[Array, Array]:
        """Targets, shape (m, 3) [m], and torques of the motors, shape (m, n) [N m], for angles of the motors."""
        targets, torques = np.empty((len(motors), 3)), np.empty_like(motors)
        for k, (angles, errors) in enumerate(zip(motors, unseen, strict=True)):
            driven = {
                joint: a + self._waves(joint, a) + e
                for joint, a, e in zip(self._robot.joints, angles, errors, strict=True)
            }
            self._data.qpos[:] = 0.0
            for joint, angle in driven.items():
                self._data.qpos[self._places[joint]] = angle
            for _ in range(ROUNDS):
                self._mujoco.mj_forward(self._model, self._data)
                pull = -self._data.qfrc_bias.copy()
                for joint, angle in driven.items():
                    self._data.qpos[self._places[joint]] = angle + self._deflection(joint, pull[self._places[joint]])
                    for axis in "xy":
                        place = self._places[f"{joint}.{axis}"]
                        self._data.qpos[place] = self._tilt(joint, axis, pull[place])
            self._mujoco.mj_forward(self._model, self._data)
            targets[k] = self._data.site("target").xpos
            torques[k] = [self._data.qfrc_bias[self._places[joint]] for joint in self._robot.joints]
        return targets, torques

    def _waves(self, joint: str, angle: float) -> float:
        """What encoder and gear are off at an angle of the motor [rad]."""
        encoder = self._of.get(("encoder_eccentricity", joint), {})
        gear = self._of.get(("gear_ripple", joint), {})
        wave = encoder.get("cos", 0.0) * np.cos(angle) + encoder.get("sin", 0.0) * np.sin(angle)
        return float(
            wave + gear.get("amplitude", 0.0) * np.cos(gear.get("order", 0.0) * angle + gear.get("phase", 0.0))
        )

    def _deflection(self, joint: str, pull: float) -> float:
        """How far a drive gives way under a torque [rad]: the root of k x + k3 x^3 = pull, and half a gap."""
        k = self._values.get(f"{joint}.stiffness", np.inf)
        soft = self._of.get(("joint_elasticity", joint), {}).get("compliance", 0.0)
        compliance = 1.0 / k + soft
        x = pull * compliance
        cubic = self._of.get(("spring_cubic", joint), {}).get("stiffness", 0.0)
        for _ in range(20 if cubic else 0):
            x -= (x / compliance + cubic * x**3 - pull) / (1.0 / compliance + 3.0 * cubic * x**2)
        gap = self._of.get(("backlash", joint), {}).get("half_gap", 0.0) - self._values.get(f"{joint}.backlash", 0.0)
        return float(x + gap * np.sign(pull))

    def _tilt(self, joint: str, axis: str, pull: float) -> float:
        k = self._values.get(f"{joint}.bearing.stiffness_{axis}", np.inf)
        soft = self._of.get(("bearing_flexibility", joint), {}).get(f"compliance_{axis}", 0.0)
        return float(pull * (1.0 / k + soft))

    def _built(self) -> Any:
        mujoco, robot = self._mujoco, self._robot
        spec, tree = mujoco.MjSpec(), robot.tree
        spec.option.gravity = tree.gravity
        spec.compiler.balanceinertia = False
        parent = spec.worldbody
        for j in range(1, tree.model.njoints):
            name, inertia = tree.model.names[j], tree.model.inertias[j]
            place, (axis, _) = tree.model.jointPlacements[j], joint_axis(tree.model, j)
            x = np.eye(3)[1] if abs(axis[0]) > 0.9 else np.eye(3)[0]
            y = np.cross(axis, x)
            turn = pin.exp3(self._value(name, "mis_y") * y) @ pin.exp3(self._value(name, "mis_x") * x)
            turn = place.rotation @ turn @ pin.exp3(self._value(name, "offset") * axis)
            shift = [self._value(name, part) for part in ("lx", "ly", "lz")]
            parent = parent.add_body(
                name=f"{name}.link",
                pos=place.translation + shift,
                quat=quaternion_wxyz(turn),
                explicitinertial=True,
                mass=max(inertia.mass + self._of.get(("link_mass", name), {}).get("mass", 0.0), 1e-9),
                ipos=inertia.lever,
                fullinertia=full_inertia(inertia.inertia + 1e-9 * np.eye(3)),
            )
            hinge = mujoco.mjtJoint.mjJNT_HINGE
            for suffix, about in (("", axis), (".y", y), (".x", x)):
                parent.add_joint(name=f"{name}{suffix}", type=hinge, axis=about)
        self._add_target(spec, parent)
        return spec

    def _add_target(self, spec: Any, body: Any) -> None:
        setup, tree = self._robot.poses, self._robot.tree
        assert setup is not None
        placement = tree.model.frames[tree.frame_id(setup.link)].placement
        error = [self._value("tool", part) for part in ("lx", "ly", "lz")]
        at = placement.act(setup.at + np.array(error))
        body.add_site(name="target", pos=at)
        payload = self._of.get(("payload", "robot"))
        if payload is not None:
            body.add_body(
                name="payload",
                pos=at,
                ipos=np.zeros(3),
                mass=payload["mass"],
                explicitinertial=True,
                inertia=[1e-6] * 3,
            )

    def _value(self, owner: str, part: str) -> float:
        return self._values.get(f"{owner}.{part}", 0.0)
