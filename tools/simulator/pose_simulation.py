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
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses, Sighting
from jointscope.tools.simulator.arm.arm_bodies import ArmBodies, true_values
from jointscope.tools.simulator.arm.pose_effects import PoseEffect, pose_effects
from jointscope.tools.simulator.world.mujoco_module import load_mujoco
from jointscope.tools.simulator.world.random_streams import random_stream

Array = NDArray[np.float64]
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
        orientation: whether the tracker tells how targets are oriented.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    effects: Iterable[str] = ()
    perfect: bool = False
    orientation: bool = False


def simulate_poses(
    robot: Robot, count: int, seed: int = 0, conditions: PoseConditions | None = None, session: str = "poses"
) -> tuple[Poses, dict[str, Any]]:
    """Simulates poses with a tracker, which sees all targets of the robot file.

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
    setup = robot.poses
    if setup is None:
        raise RobotError(f"{robot.path.name} has no section `poses`; see docs/poses.md")
    if count < 1:
        raise SimulationError(f"number of poses: expected 1 or more, got {count}")
    values = true_values(robot, seed, conditions.values, conditions.perfect)
    effects = pose_effects(conditions.effects, robot.joints)
    orientations = _orientations(robot, seed) if conditions.orientation else {}
    arm, rng = _Arm(robot, values, effects, orientations), random_stream(seed, session)
    low, high = np.nan_to_num(robot.tree.limits.T, posinf=np.pi, neginf=-np.pi)
    middle, half = (low + high) / 2.0, np.minimum((high - low) / 2.0, np.pi)
    q = middle + REACH * half * rng.uniform(-1.0, 1.0, (count, robot.n))
    unseen = setup.joint_sigmas * rng.standard_normal(q.shape)
    sites, torques = arm.at_rest(q, unseen)
    T = np.eye(4) if setup.tracker is None else setup.tracker
    shift = np.array([values.get(f"tracker.{part}", 0.0) for part in ("lx", "ly", "lz")])
    drift = np.linspace(0.0, 1.0, count)[:, None] * arm.drift

    def seen(targets: Array) -> Array:
        noise = setup.target_sigma * rng.standard_normal(targets.shape)
        return np.asarray((targets - T[:3, 3]) @ T[:3, :3] + shift + drift + noise)

    def turned(turns: Array) -> Array | None:
        if not conditions.orientation:
            return None
        noise = setup.turn_sigma * rng.standard_normal((len(turns), 3))
        return np.stack([T[:3, :3].T @ R @ pin.exp3(w) for R, w in zip(turns, noise, strict=True)])

    (targets, turns), *others = sites.values()
    measured = seen(targets)
    read = q + ENCODER * rng.standard_normal(q.shape)
    turn = turned(turns)
    sightings = zip(setup.other_names, others, strict=True)
    more = tuple(Sighting(name, seen(places), turned(R)) for name, (places, R) in sightings)
    truth = {
        "robot": robot.name,
        "seed": seed,
        "session": session,
        "parameters": values,
        "effects": [effect.truth for effect in effects],
        "targets": targets.tolist(),
    }
    if conditions.orientation:
        truth["orientations_xyzw"] = {name: pin.Quaternion(R).coeffs().tolist() for name, R in arm.orientations.items()}
    names = tuple(map(str, range(count)))
    return Poses("simulation", "", names, read, measured, torque=torques, turn=turn, others=more), truth


def _orientations(robot: Robot, seed: int) -> dict[str, Array]:
    """Any orientation of each target on its link that the robot file does not give, R_link_target by name."""
    rng, setup = random_stream(seed, "orientations"), robot.poses
    assert setup is not None
    drawn = {target.name: rng.standard_normal(4) for target in setup.targets}
    given = {target.name: target.turn for target in setup.targets if target.turn is not None}
    return {
        name: np.array(pin.Quaternion(v / np.linalg.norm(v)).toRotationMatrix()) for name, v in drawn.items()
    } | given


class _Arm:
    """A compiled model and the springs of its hinges."""

    def __init__(
        self,
        robot: Robot,
        values: Mapping[str, float],
        effects: Iterable[PoseEffect],
        orientations: Mapping[str, Array],
    ):
        self._mujoco, self._robot, self.orientations = load_mujoco(), robot, orientations
        self._bodies = ArmBodies(robot, values, effects, orientations)
        self.drift = np.array([self._bodies.size("tracker_drift", "robot", axis) for axis in "xyz"])
        self._model = self._built().compile()
        self._data = self._mujoco.MjData(self._model)
        self._places = {
            self._model.joint(i).name: int(self._model.joint(i).qposadr[0]) for i in range(self._model.njnt)
        }

    def at_rest(self, motors: Array, unseen: Array) -> tuple[dict[str, tuple[Array, Array]], Array]:
        """Targets for angles of the motors, and torques of the motors, shape (m, n) [N m].

        Returns:
            Places, shape (m, 3) [m], and orientations, shape (m, 3, 3), of all targets by name; torques.
        """
        assert self._robot.poses is not None
        names, m = [target.name for target in self._robot.poses.targets], len(motors)
        sites, torques = {n: (np.empty((m, 3)), np.empty((m, 3, 3))) for n in names}, np.empty_like(motors)
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
            for name, (places, turns) in sites.items():
                site = self._data.site(f"target {name}")
                places[k], turns[k] = site.xpos, site.xmat.reshape(3, 3)
            torques[k] = [self._data.qfrc_bias[self._places[joint]] for joint in self._robot.joints]
        return sites, torques

    def _waves(self, joint: str, angle: float) -> float:
        """By how much a joint is ahead of its reading [rad]: what the gear does, less what the encoder has too much."""
        cos, sin = (self._bodies.size("encoder_eccentricity", joint, part) for part in ("cos", "sin"))
        size, order, phase = (self._bodies.size("gear_ripple", joint, part) for part in ("amplitude", "order", "phase"))
        return float(size * np.cos(order * angle + phase) - cos * np.cos(angle) - sin * np.sin(angle))

    def _deflection(self, joint: str, pull: float) -> float:
        """How far a drive gives way under a torque [rad]: the root of k x + k3 x^3 = pull, and half a gap."""
        compliance = self._bodies.compliance(joint)
        x = pull * compliance
        cubic = self._bodies.size("spring_cubic", joint, "stiffness")
        for _ in range(20 if cubic else 0):
            x -= (x / compliance + cubic * x**3 - pull) / (1.0 / compliance + 3.0 * cubic * x**2)
        gap = self._bodies.size("backlash", joint, "half_gap") - self._bodies.value(joint, "backlash")
        return float(x + gap * np.sign(pull))

    def _tilt(self, joint: str, axis: str, pull: float) -> float:
        return float(pull * self._bodies.tilt_compliance(joint, axis))

    def _built(self) -> Any:
        mujoco = self._mujoco
        spec = mujoco.MjSpec()
        spec.option.gravity = self._robot.tree.gravity
        spec.compiler.balanceinertia = False
        for name, (body, axes) in self._bodies.add_to(spec).items():
            for suffix, about in axes.items():
                body.add_joint(name=f"{name}{suffix}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=about)
        return spec
