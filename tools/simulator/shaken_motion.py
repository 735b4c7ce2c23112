# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of any robot with drives and encoders that is shaken in some poses, as its own bags hold them.

One run for each pose: experiment after experiment without a pause, each with periods in which it settles. What goes in
is the command, weight and controller included, for that is what acts on the robot; it is held from tick to tick.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.recordings.signals import Excitation
from jointscope.tools.simulator.arm.multisine import Multisine
from jointscope.tools.simulator.arm.strength import largest_amplitude
from jointscope.tools.simulator.frequency_simulation import SETTLE, SHARE, SWING, Shaking, checked_poses
from jointscope.tools.simulator.loop.shaker import HeldPose, Shaker
from jointscope.tools.simulator.occasion import Conditions, Occasion
from jointscope.tools.simulator.world.engine import TICK

Array = NDArray[np.float64]
SLOW = 0.75  # [Hz] of the slow sine, about
SWING_SHARE = 0.05  # of a joint's range that the slow sine takes, at most


@dataclass(frozen=True)
class ShakenRun:
    """A pose.

    Attributes:
        name: of its bag, without the ending.
        recording: what the bag holds.
        pose: angles of all joints, shape (n,) [rad or m].
    """

    name: str
    recording: Recording
    pose: Array


def simulate_shaken_motion(
    robot: Robot,
    seed: int = 0,
    conditions: Conditions | None = None,
    shaking: Shaking | None = None,
    session: str = "frequency",
    progress: Callable[[float], None] | None = None,
) -> tuple[list[ShakenRun], Multisine, Excitation, dict[str, Any]]:
    """Simulates a robot that is shaken by its own drives.

    Args:
        robot: with commands and sensors.
        seed: of the robot; the same seed is the same robot in every kind of motion.
        conditions: what is true of robot and sensors; friction is that of `conditions`.
        shaking: how it is shaken.
        session: another one has other poses and phases.
        progress: called with the share done.

    Returns:
        A recording of each pose, the excitation of all and its schedule, and the truth, fit for JSON.

    Raises:
        SimulationError: MuJoCo is missing, numbers that cannot be, or a pose that the drives cannot hold.
        RobotError: a robot without equations of motion.
        EffectError: an unknown effect.
    """
    robot.need_link_dynamics()
    conditions, shaking, told = conditions or Conditions(), shaking or Shaking(), progress or (lambda share: None)
    poses = checked_poses(robot, shaking, seed, session, TICK)
    of_pose = {f"frequency_{k + 1}": pose for k, pose in enumerate(poses)}
    period = 1.0 / shaking.f0
    sets = 2 * robot.n * shaking.realisations
    seconds = sets * (SETTLE + shaking.periods) * period
    occasions = {
        name: Occasion(robot, f"{session} {name}", seconds, seed, replace(conditions, hardware_seed=seed))
        for name in of_pose
    }
    held = [HeldPose(occasions[name].truth, pose) for name, pose in of_pose.items()]
    multisine = _multisine(held, shaking, seed, session)
    swing = _swing(occasions["frequency_1"].truth)
    excitation = multisine.excitation(shaking.periods, 0.0, SETTLE, _carrier(shaking.f0) * int(np.any(swing > 0.0)))
    torque = np.concatenate(
        [
            np.tile(multisine.torque(e.realisation, e.number, e.sign, TICK), (e.periods, 1))
            for e in excitation.experiments
        ]
    )
    runs: list[ShakenRun] = []
    for (name, pose), still in zip(of_pose.items(), held, strict=True):
        occasion = occasions[name]
        occasion.start = pose
        controller = Shaker(still, torque, swing, 2.0 * np.pi * excitation.carrier, occasion.encoder())
        trajectory = occasion.run(controller, partial(_share, told, len(runs), len(poses)))
        runs.append(ShakenRun(name, occasion.recording(trajectory, controller.commands), pose))
    truth = occasion.told() | {"session": session, "poses": {run.name: run.pose.tolist() for run in runs}}
    return runs, multisine, excitation, truth


def _share(told: Callable[[float], None], done: int, of: int, share: float) -> None:
    told((done + share) / of)


def _carrier(f0: float) -> int:
    """Line of the slow sine: odd, so that what it mixes falls on even lines."""
    return max(1, 2 * round((SLOW / f0 - 1.0) / 2.0) + 1)


def _swing(robot: Robot) -> Array:
    """Amplitude of the slow sine of each motor [rad or m]: it keeps dry friction from sticking, where there is some."""
    low, high = np.nan_to_num(robot.tree.limits.T, posinf=np.pi, neginf=-np.pi)
    dry = np.array([robot.parameter(f"{joint}.coulomb_torque").value > 0.0 for joint in robot.joints])
    return np.asarray(np.minimum(SWING, SWING_SHARE * (high - low)) * dry)


def _multisine(held: list[HeldPose], shaking: Shaking, seed: int, session: str) -> Multisine:
    """As large as the drives give and the response stays that of the pose, in all poses the same."""
    left, inertia = (np.min([getattr(one, part) for one in held], axis=0) for part in ("left", "inertia"))
    unit = Multisine.drawn(shaking.f0, shaking.highest, np.ones(len(left)), shaking.realisations, seed, session)
    share = SHARE if shaking.share is None else shaking.share
    return replace(unit, amplitude=largest_amplitude(unit, share, left, inertia, held[0].dry))
