# SPDX-License-Identifier: BSD-3-Clause
"""Regressors of trials: how residuals change with each size of an effect at its null value.

At null a law's torque is zero for every motion, so only its derivative by its sizes matters, evaluated along the
smoothed motion. Effects act in three ways: accelerations at the ticks, accelerations held over each step (commands),
and errors of readings. A soft bearing is scored through its compliance: the tilt is compliance times reaction torque,
passed through a resonance; gyros see its rate, the joints its inertia.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter

from jointscope.graphs.trial_signals import TrialSignals
from jointscope.graphs.trials import Trial
from jointscope.robots.effect_at import EffectAt
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.inertia_effect import InertiaEffect
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.lateness import shifts
from jointscope.robots.structured_tree import (
    InertiaChange,
    bearing_names,
    inertia_about_joint,
    inertia_torque,
    with_bearings,
)

Array = NDArray[np.float64]
STEP = 1e-30

SensorColumn = Callable[["SensorPart"], Array]


@dataclass(frozen=True)
class SensorPart:
    """Some samples of a sensor, as its factor was linearised.

    Attributes:
        name: of the sensor.
        channels: index of each row among the sensor's channels, shape (r,).
        stamps: shape (s,) [s].
        reading: predicted reading without zero or bias, shape (s, r).
        reading_rate: its time derivative, shape (s, r).
    """

    name: str
    channels: NDArray[np.intp]
    stamps: Array
    reading: Array
    reading_rate: Array


@dataclass(frozen=True)
class Column:
    """Regressor of one size.

    Attributes:
        at_ticks: accelerations at the ticks, shape (m + 1, r); None for none.
        in_steps: accelerations held over the steps, shape (m, r); None for none.
        reading: error of readings, shape (s, r) for a SensorPart; None for none.
    """

    at_ticks: Array | None = None
    in_steps: Array | None = None
    reading: SensorColumn | None = field(default=None, repr=False)


def columns_of(trial: Trial, s: TrialSignals) -> list[Column]:
    """One column for each size of a trial."""
    effect = trial.here.effect
    if isinstance(effect, JointTorque):
        return _joint_torque(trial, s)
    if isinstance(effect, RobotTorque):
        return _robot_torque(trial, s)
    if isinstance(effect, CommandEffect):
        return _command(trial, s)
    if isinstance(effect, InertiaEffect):
        return _inertia(trial, s)
    if isinstance(effect, ReadingEffect):
        return [Column(reading=_reading(trial, s, p.name)) for p in trial.sizes]
    if isinstance(effect, TimeShift):
        return [Column(reading=_late(trial, s, p.name)) for p in trial.sizes]
    assert isinstance(effect, Structure)
    if effect.form == "bearing":
        return _bearing(trial, s)
    if effect.form == "coriolis":
        return _coriolis(s)
    return [Column(reading=_elasticity(trial.here, s))] if effect.form == "elasticity" else []


def _null(trial: Trial) -> dict[str, float]:
    return {**{p.name: p.null for p in trial.sizes}, **trial.shapes}


def _joint_torque(trial: Trial, s: TrialSignals) -> list[Column]:
    effect, layout = trial.here.effect, s.model.layout
    assert isinstance(effect, JointTorque)
    j = s.robot.joints.index(trial.here.owner)
    signals = joint_signals(s, j)
    p = _null(trial)
    if effect.memory is not None:
        signals = signals_with_memory(effect, signals, p, s.ticks)
    link = int(layout.joint_link[j])
    motor = layout.n_link + layout.motors.index(trial.here.owner) if trial.here.owner in layout.motors else link
    rows = {"link": ((link, 1.0),), "motor": ((motor, 1.0),), "spring": ((link, -1.0), (motor, 1.0))}[effect.side]
    found = []
    for size in trial.sizes:
        slope = np.imag(effect.law(signals, {**p, size.name: p[size.name] + 1j * STEP})) / STEP
        tau = np.zeros((len(s.ticks), layout.n_rates))
        for row, sign in rows:
            tau[:, row] = sign * slope
        found.append(Column(at_ticks=s.accelerations(tau)))
    return found


def joint_signals(s: TrialSignals, j: int) -> JointSignals:
    """Motion of one joint."""
    layout = s.model.layout
    return JointSignals(
        q_link=s.x[:, layout.joint_q[j]],
        v_link=s.x[:, layout.joint_v[j]],
        q_motor=s.x[:, layout.motor_q[j]],
        v_motor=s.x[:, layout.motor_v[j]],
        tau_spring=s.tau_spring[:, j],
        stiffness=float(s.stiffness[j]),
        sharpness=s.robot.choices.friction_sharpness,
    )


def signals_with_memory(effect: JointTorque, signals: JointSignals, p: dict[str, float], ticks: Array) -> JointSignals:
    """The same with the effect's memory integrated along the motion, by linearly implicit steps.

    Each step takes dz/dt = f(z) as f(z_k) + f'(z_k) (z - z_k) and solves that exactly; for rates that are linear in z
    between kinks of the motion nothing else is needed.
    """
    assert effect.memory is not None
    rate, h = effect.memory.rate, np.diff(ticks)
    at = [np.broadcast_to(np.real(rate(_with(signals, z), p)), ticks.shape) for z in (0.0, 1.0, -1.0)]
    constant, slope, bend = at[0], 0.5 * (at[1] - at[2]), 0.5 * (at[1] + at[2]) - at[0]
    constant, slope, bend = (0.5 * (part[1:] + part[:-1]) for part in (constant, slope, bend))
    z = [0.0]
    for step, f0, f1, f2 in zip(h.tolist(), constant.tolist(), slope.tolist(), bend.tolist(), strict=True):
        now = z[-1]
        f, df = f0 + f1 * now + f2 * now * now, f1 + 2.0 * f2 * now
        z.append(now + (step * f if abs(df * step) < 1e-9 else f * math.expm1(df * step) / df))
    return _with(signals, np.array(z))


SIGNALS = ("q_link", "v_link", "q_motor", "v_motor", "tau_spring", "stiffness")


def _with(signals: JointSignals, memory: Array | float) -> JointSignals:
    values = [getattr(signals, name) for name in SIGNALS]
    return JointSignals(*values, sharpness=signals.sharpness, memory=memory)


def _robot_torque(trial: Trial, s: TrialSignals) -> list[Column]:
    effect, layout, joints = trial.here.effect, s.model.layout, s.robot.joints
    assert isinstance(effect, RobotTorque)
    signals = RobotSignals(
        q_link=s.x[:, layout.joint_q],
        v_link=s.x[:, layout.joint_v],
        q_motor=s.x[:, layout.motor_q],
        v_motor=s.x[:, layout.motor_v],
        stiffness=s.stiffness,
        damping=s.damping,
        joints=joints,
        owner=joints.index(trial.here.owner) if trial.here.owner in joints else 0,
        sharpness=s.robot.choices.friction_sharpness,
    )
    p, found = _null(trial), []
    for size in trial.sizes:
        link, motor = effect.law(signals, {**p, size.name: p[size.name] + 1j * STEP})
        tau = np.zeros((len(s.ticks), layout.n_rates))
        for j, joint in enumerate(joints):
            tau[:, layout.joint_link[j]] += np.imag(link)[:, j] / STEP
            row = layout.n_link + layout.motors.index(joint) if joint in layout.motors else layout.joint_link[j]
            tau[:, row] += np.imag(motor)[:, j] / STEP
        found.append(Column(at_ticks=s.accelerations(tau)))
    return found


def _command(trial: Trial, s: TrialSignals) -> list[Column]:
    effect, joints = trial.here.effect, s.robot.joints
    assert isinstance(effect, CommandEffect)
    chosen = range(len(joints)) if trial.here.owner == "robot" else (joints.index(trial.here.owner),)
    total = {size.name: np.zeros(s.response.shape[:2]) for size in trial.sizes}
    for j in chosen:
        _, slopes = effect.law(s.ticks, s.u[:, j], _null(trial))
        for name, slope in slopes.items():
            if name in total:
                total[name] += s.response[:, :, j] * slope[:, None]
    return [Column(in_steps=total[size.name]) for size in trial.sizes]


def _inertia(trial: Trial, s: TrialSignals) -> list[Column]:
    effect, tree, layout = trial.here.effect, s.robot.kinematic_tree, s.model.layout
    assert isinstance(effect, InertiaEffect)
    joint = tree.model.getJointId(trial.here.owner)
    directions = effect.change(inertia_about_joint(tree.model, joint))
    q, v = s.x[:, layout.q_link], s.x[:, layout.v_link]
    found = []
    for size in trial.sizes:
        change = InertiaChange(size.name, joint, np.asarray(directions[size.name], float))
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, : layout.n_link] = -inertia_torque(tree, change, q, v, s.a_link, 1.0)
        found.append(Column(at_ticks=s.accelerations(tau)))
    return found


def _coriolis(s: TrialSignals) -> list[Column]:
    layout, tree = s.model.layout, s.robot.kinematic_tree.with_coriolis(True)
    q, v = s.x[:, layout.q_link], s.x[:, layout.v_link]
    still = np.zeros_like(v)
    tau = np.zeros((len(s.ticks), layout.n_rates))
    tau[:, : layout.n_link] = tree.torque(q, still, still) - tree.torque(q, v, still)
    return [Column(at_ticks=s.accelerations(tau))]


def _reading(trial: Trial, s: TrialSignals, size: str) -> SensorColumn:
    effect, owner = trial.here.effect, trial.here.owner
    assert isinstance(effect, ReadingEffect)
    p = _null(trial)
    moved = {**p, size: p[size] + 1j * STEP}
    encoder = s.robot.motor_encoder.name

    def column(part: SensorPart) -> Array:
        error = np.zeros(part.reading.shape)
        if part.name == owner:
            error[:] = (np.imag(effect.law(part.reading, part.stamps, moved)) / STEP)[:, : error.shape[1]]
        elif part.name == encoder and owner in s.robot.joints:
            row = np.flatnonzero(part.channels == s.robot.joints.index(owner))
            if len(row):
                error[:, row] = np.imag(effect.law(part.reading[:, row], part.stamps, moved)) / STEP
        return error

    return column


def _late(trial: Trial, s: TrialSignals, size: str) -> SensorColumn:
    effect = trial.here.effect
    assert isinstance(effect, TimeShift)
    p = _null(trial)

    def column(part: SensorPart) -> Array:
        slope = effect.late(part.stamps, p)[1][size]
        hit = np.array([shifts(trial.here, s.robot, part.name, int(channel)) for channel in part.channels])
        return -part.reading_rate * slope[:, None] * hit

    return column


def _elasticity(here: EffectAt, s: TrialSignals) -> SensorColumn:
    """A rigid joint that becomes elastic: the motor runs ahead of the link by compliance times transmitted torque."""
    layout, tree, j = s.model.layout, s.robot.kinematic_tree, s.robot.joints.index(here.owner)
    torque = tree.torque(s.x[:, layout.q_link], s.x[:, layout.v_link], s.a_link)[:, layout.joint_link[j]]

    def column(part: SensorPart) -> Array:
        error = np.zeros(part.reading.shape)
        if part.name == s.robot.motor_encoder.name:
            error[:, part.channels == j] = np.interp(part.stamps, s.ticks, torque)[:, None]
        return error

    return column


def _bearing(trial: Trial, s: TrialSignals) -> list[Column]:
    owner, layout = trial.here.owner, s.model.layout
    tree = s.robot.kinematic_tree.with_model(with_bearings(s.robot.kinematic_tree.model, (owner,)))
    names = tree.joints
    old = np.array([names.index(name) for name in layout.links])
    q, v, a = (np.zeros((len(s.ticks), len(names))) for _ in range(3))
    q[:, old], v[:, old], a[:, old] = s.x[:, layout.q_link], s.x[:, layout.v_link], s.a_link
    reaction, M = tree.torque(q, v, a), tree.mass_matrix(q)
    omega, ratio = 2.0 * np.pi * trial.shapes["frequency"], trial.shapes["damping_ratio"]
    found = []
    for name in bearing_names(owner):
        b = names.index(name)
        tilt = -_resonance(reaction[:, b], s.ticks, omega, ratio)
        speed = np.gradient(tilt, s.ticks)
        tau = np.zeros((len(s.ticks), layout.n_rates))
        tau[:, : layout.n_link] = -M[:, old, b] * np.gradient(speed, s.ticks)[:, None]
        rates = _gyro_rates(s, tree, q, v, b, tilt, speed)
        found.append(Column(at_ticks=s.accelerations(tau), reading=_interpolated(rates, s.ticks)))
    return found


def _gyro_rates(s: TrialSignals, tree, q: Array, v: Array, b: int, tilt: Array, speed: Array) -> dict[str, Array]:  # type: ignore[no-untyped-def]
    """What every gyro sees of a tilting bearing, by name, shape (m + 1, 3) [rad/s]."""
    found = {}
    for gyro in s.robot.gyros:
        _, by_q, by_v = tree.body_rate(gyro.body, q, v)
        found[gyro.name] = (by_q[:, :, b] * tilt[:, None] + by_v[:, :, b] * speed[:, None]) @ gyro.R_imu_body.T
    return found


def _interpolated(signals: dict[str, Array], ticks: Array) -> SensorColumn:
    def column(part: SensorPart) -> Array:
        if part.name not in signals:
            return np.zeros(part.reading.shape)
        signal = signals[part.name]
        return np.column_stack([np.interp(part.stamps, ticks, signal[:, channel]) for channel in part.channels])

    return column


def _resonance(signal: Array, ticks: Array, omega: float, ratio: float) -> Array:
    """Response of a mass on spring and damper, with unit gain at rest."""
    h = float(np.median(np.diff(ticks)))
    b, a = bilinear([omega**2], [1.0, 2.0 * ratio * omega, omega**2], fs=1.0 / h)
    start = signal[0]
    return np.asarray(lfilter(b, a, signal - start) + start, dtype=np.float64)
