# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of an arm that is shaken in some poses: multisines on a slow motion, integrated by MuJoCo."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RobotError, SimulationError
from jointscope.robots.files.sections.frequency_section import no_frequency
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.signals import Excitation, Signal, Signals
from jointscope.tools.simulator.arm.arm_bodies import true_values
from jointscope.tools.simulator.arm.multisine import Multisine
from jointscope.tools.simulator.arm.pose_effects import PoseEffect, pose_effects
from jointscope.tools.simulator.arm.shaken_arm import STEP, ShakenArm
from jointscope.tools.simulator.arm.strength import OVER_FRICTION, largest_amplitude
from jointscope.tools.simulator.pose_simulation import PoseConditions
from jointscope.tools.simulator.world.random_streams import random_stream

Array = NDArray[np.float64]
SHARE = 0.4  # of what a drive can give beside the weight, that the largest of the excitation takes
SETTLE = 2  # periods before those that are kept
BETWEEN = 2.0  # [s] from experiment to experiment, in which nothing is recorded
SWING = 0.05  # [rad] of the motion that carries the excitation
ACCELERATION = 0.7  # [rad/s^2] rms with which a motor is shaken
REACH = 0.5  # share of each joint's range that poses fill
ENCODER, TORQUE = 1e-6, 0.05  # [rad], [N m] noise of each sample


@dataclass(frozen=True)
class Shaking:
    """How an arm is shaken.

    Attributes:
        poses: angles of all joints, shape (n,) each [rad]; none: `count` of them are drawn.
        count: number of poses that are drawn.
        realisations: sets of random phases.
        periods: that are kept of each experiment.
        f0: distance of the lines [Hz].
        highest: no line is above it [Hz].
        rate: of the samples [Hz].
        friction: "smooth" or "dry"; of an arm with a section `frequency`.
        share: of what drives can give beside the weight, that the largest of the excitation takes; None: an arm with a
            section `frequency` is accelerated with 0.7 rad/s^2, others take 0.4.
    """

    poses: Sequence[Array] = ()
    count: int = 2
    realisations: int = 2
    periods: int = 2
    f0: float = 0.25
    highest: float = 100.0
    rate: float = 1000.0
    friction: str = "smooth"
    share: float | None = None


@dataclass(frozen=True)
class ShakenRecording:
    """A pose.

    Attributes:
        name: of its bag, without the ending.
        signals: torques of the motors that are shaken, positions of all joints.
        command: the excitation alone, shape (samples, n shaken) [N m].
        excitation: its description.
    """

    name: str
    signals: Signals
    command: Array
    excitation: Excitation


def simulate_frequency(
    robot: Robot,
    seed: int = 0,
    conditions: PoseConditions | None = None,
    shaking: Shaking | None = None,
    session: str = "frequency",
    progress: Callable[[float], None] | None = None,
) -> tuple[list[ShakenRecording], Multisine, dict[str, Any]]:
    """Simulates an arm that is shaken.

    Args:
        robot: with a section `frequency`.
        seed: of the arm; the same seed is the same arm, in poses on a tracker, too.
        conditions: what is true of it.
        shaking: how it is shaken.
        session: another one has other poses and phases of the same arm.
        progress: called with the share done.

    Returns:
        A recording of each pose, the excitation, and the truth, fit for JSON.

    Raises:
        RobotError: the robot file does not say what is shaken.
        SimulationError: MuJoCo is missing, or numbers that cannot be.
        EffectError: an unknown effect.
    """
    conditions, shaking = conditions or PoseConditions(), shaking or Shaking()
    if robot.frequency is None:
        raise RobotError(no_frequency(robot))
    poses = checked_poses(robot, shaking, seed, session, STEP)
    values = true_values(robot, seed, conditions.values, conditions.perfect)
    effects = pose_effects(conditions.effects, robot.joints)
    arms = [ShakenArm(robot, values, effects, np.asarray(pose), shaking.friction) for pose in poses]
    inertias = np.array([arm.inertias for arm in arms])
    dry = np.array([values.get(f"{joint}.coulomb_torque", 0.0) for joint in robot.frequency.joints])
    rms = np.maximum(ACCELERATION * inertias.max(axis=0), OVER_FRICTION * dry)
    multisine = Multisine.drawn(shaking.f0, shaking.highest, rms, shaking.realisations, seed, session)
    if shaking.share is not None:
        left = np.min([arm.left for arm in arms], axis=0)
        amplitude = largest_amplitude(multisine, shaking.share, left, inertias.min(axis=0), dry)
        multisine = replace(multisine, amplitude=amplitude)
    excitation = multisine.excitation(shaking.periods, BETWEEN)
    found, told = [], progress or (lambda share: None)
    for k, (arm, pose) in enumerate(zip(arms, poses, strict=True)):
        samples = _experiments(arm, multisine, excitation, shaking, partial(_share, told, k, len(arms)))
        rng = random_stream(seed, session, f"noise {k}")
        found.append(_recording(robot, f"frequency_{k + 1}", np.asarray(pose), samples, excitation, effects, rng))
    truth = {
        "robot": robot.name,
        "seed": seed,
        "session": session,
        "friction": shaking.friction,
        "parameters": values,
        "effects": [effect.truth for effect in effects],
        "poses": {r.name: np.asarray(pose).tolist() for r, pose in zip(found, poses, strict=True)},
    }
    return found, multisine, truth


def _share(told: Callable[[float], None], done: int, of: int, share: float) -> None:
    told((done + share) / of)


def checked_poses(robot: Robot, shaking: Shaking, seed: int, session: str, step: float) -> list[Array]:
    """The poses in which a robot is shaken, shape (n,) each.

    Args:
        robot: to be shaken.
        shaking: how.
        seed: of the robot.
        session: of the recordings.
        step: of the simulator [s].

    Raises:
        SimulationError: a pose or a number cannot be.
    """
    wrong = next((pose for pose in shaking.poses if len(pose) != robot.n), None)
    if wrong is not None:
        raise SimulationError(f"a pose of {robot.name} has {robot.n} angles [rad], got {len(wrong)}")
    if min(shaking.count, shaking.realisations, shaking.periods) < 1:
        raise SimulationError("numbers of poses, realisations and periods: expected 1 or more")
    every = 1.0 / (shaking.rate * step)
    if abs(every - round(every)) > 1e-6 or every < 0.5:
        raise SimulationError(f"rate {shaking.rate:g} Hz: expected {1.0 / step:g} Hz over a whole number")
    if not shaking.f0 > 0.0 or abs(shaking.rate / shaking.f0 - round(shaking.rate / shaking.f0)) > 1e-6:
        raise SimulationError(
            f"f0 {shaking.f0:g} Hz: expected a period of a whole number of samples of {1e3 / shaking.rate:g} ms"
        )
    if shaking.highest < shaking.f0:
        raise SimulationError(f"lines up to {shaking.highest:g} Hz: the lowest is at f0, {shaking.f0:g} Hz")
    if shaking.highest > 0.45 * shaking.rate:
        raise SimulationError(f"lines up to {shaking.highest:g} Hz need samples at {shaking.highest / 0.45:.4g} Hz")
    return list(shaking.poses) or _drawn_poses(robot, shaking.count, seed, session)


def _drawn_poses(robot: Robot, count: int, seed: int, session: str) -> list[Array]:
    low, high = np.nan_to_num(robot.tree.limits.T, posinf=np.pi, neginf=-np.pi)
    half = REACH * np.minimum((high - low) / 2.0, np.pi)
    turns = random_stream(seed, session, "poses").uniform(-1.0, 1.0, (count, robot.n))
    return list((low + high) / 2.0 + half * turns)


def _experiments(
    arm: ShakenArm, multisine: Multisine, excitation: Excitation, shaking: Shaking, told: Callable[[float], None]
) -> tuple[Array, Array, Array, Array]:
    """Times, angles, torques and commands of all experiments of a pose."""
    every, speed = round(1.0 / (shaking.rate * STEP)), 2.0 * np.pi * excitation.carrier
    times, angles, torques, commands = [], [], [], []
    for k, e in enumerate(excitation.experiments):
        wave = multisine.torque(e.realisation, e.number, e.sign, 0.5 * STEP)
        q, tau = arm.shaken(wave, SWING, speed, SETTLE, shaking.periods, every)
        times.append(e.start + np.arange(len(q)) / shaking.rate)
        angles.append(q)
        torques.append(tau)
        commands.append(np.tile(wave[:: 2 * every], (shaking.periods, 1)))
        told((k + 1) / len(excitation.experiments))
    stacked = (np.concatenate(part) for part in (times, angles, torques, commands))
    t, q, tau, command = stacked
    return t, q, tau, command


def _recording(
    robot: Robot,
    name: str,
    pose: Array,
    samples: tuple[Array, Array, Array, Array],
    excitation: Excitation,
    effects: Sequence[PoseEffect],
    rng: np.random.Generator,
) -> ShakenRecording:
    """What the sensors make of it."""
    assert robot.frequency is not None
    (times, angles, torques, command), shaken = samples, robot.frequency.joints
    places = [robot.joints.index(joint) for joint in shaken]
    q = np.tile(pose, (len(times), 1))
    q[:, places] = angles
    torques = torques.copy()
    for effect in effects:
        if effect.id == "encoder_eccentricity":
            i = robot.joints.index(effect.owner)
            q[:, i] += effect.parameters["cos"] * np.cos(q[:, i]) + effect.parameters["sin"] * np.sin(q[:, i])
        if effect.id == "torque_constant_error" and effect.owner in shaken:
            torques[:, shaken.index(effect.owner)] /= 1.0 + effect.parameters["share"]
        if effect.id == "torque_delay":
            torques = _late(torques, effect.parameters["seconds"], excitation, times)
    q += ENCODER * rng.standard_normal(q.shape)
    torques = torques + TORQUE * rng.standard_normal(torques.shape)
    signals = Signals(name, "", Signal(times, torques, shaken), Signal(times, q, robot.joints))
    return ShakenRecording(name, signals, command, excitation)


def _late(torques: Array, seconds: float, excitation: Excitation, times: Array) -> Array:
    """Torques as they were some time before, experiment by experiment, which are steady and so repeat themselves."""
    step, found = float(np.median(np.diff(times))), torques.copy()
    for e in excitation.experiments:
        rows = np.flatnonzero(
            (times > e.start - 0.5 * step) & (times < e.start + e.periods / excitation.f0 - 0.5 * step)
        )
        X, f = np.fft.rfft(torques[rows], axis=0), np.fft.rfftfreq(len(rows), step)
        found[rows] = np.fft.irfft(X * np.exp(-2j * np.pi * f * seconds)[:, None], len(rows), axis=0)
    return found
