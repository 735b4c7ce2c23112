# SPDX-License-Identifier: BSD-3-Clause
"""Torque laws of effects at one state: value and all slopes from one evaluation of the law.

The law gets its signals side by side, the first set as they are and one more for each signal, moved by i 1e-30: the
real part of the first is the torque, the imaginary parts of the others are the slopes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.joint_springs import Springs
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, Law
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]
STEP = 1e-30  # of complex derivatives


class LawAtOneState(Protocol):
    """A law with fixed parameters."""

    def add(self, x: Array, tau: Array, by_state: Array | None) -> None:
        """Adds torques and rates of memories at a state.

        Args:
            x: state, shape (d,).
            tau: receives them, shape (r,).
            by_state: receives their derivative, shape (r, d); None where it is not wanted.
        """


class JointLawAtOneState:
    """The law of one joint.

    Args:
        here: the effect, of kind JointTorque.
        robot: the robot.
        springs: of the base model, for stiffness and damping.
        values: all parameters by full name.
    """

    def __init__(self, here: EffectAt, robot: Robot, springs: Springs, values: Mapping[str, float]):
        assert isinstance(here.effect, JointTorque)
        layout, j = robot.layout, robot.joints.index(here.owner)
        self._p, self._sharpness = here.own(values), robot.sharpness_of(here.owner, values)
        gap = here.effect.behind(robot.effects, here.owner)
        self._gap = tuple(values[name] for name in gap) or None
        columns = [layout.joint_q[j], layout.joint_v[j], layout.motor_q[j], layout.motor_v[j]]
        link, motor = int(layout.joint_link[j]), int(layout.motor_row[j])
        rows = {"link": ((link, 1.0),), "motor": ((motor, 1.0),), "spring": ((link, -1.0), (motor, 1.0))}
        self._laws: list[tuple[Law, tuple[tuple[int, float], ...]]] = [(here.effect.law, rows[here.effect.side])]
        if here.effect.memory is not None:
            index = layout.memories.index(here.label)
            columns.append(layout.memory.start + index)
            self._laws.append((here.effect.memory.rate, ((layout.n_link + layout.n_motor + index, 1.0),)))
        self._columns = np.array(columns, dtype=np.intp)
        self._stiffness, self._damping = float(springs.stiffness[j]), float(springs.damping[j])
        self._weight, self._values = CarriedWeight(robot).on(here.owner, here.effect, self._p), values
        self._joint, self._q_link = j, layout.q_link
        # torque of the spring by (q_link, v_link, q_motor, v_motor); a set of signals for each and for the torque
        self._spring = np.array([self._stiffness, self._damping, -self._stiffness, -self._damping])
        count = len(columns) + 1
        self._moves = 1j * STEP * np.hstack([np.zeros((count, 1)), np.eye(count)])

    def add(self, x: Array, tau: Array, by_state: Array | None) -> None:
        """Adds the torque, and the rate of the memory; see `LawAtOneState`."""
        own = x[self._columns]
        load = (
            self._spring @ own[:4]
            if self._weight is None
            else self._weight.torque(x[None], self._values)[0, self._joint]
        )
        signals = np.append(own, load)[:, None]
        if by_state is not None:
            signals = signals + self._moves
        q_link, v_link, q_motor, v_motor = signals[:4]
        at = JointSignals(
            q_link=q_link,
            v_link=v_link,
            q_motor=q_motor,
            v_motor=v_motor,
            tau_spring=signals[-1],
            stiffness=self._stiffness,
            sharpness=self._sharpness,
            memory=signals[4] if len(signals) > 5 else 0.0,
            gap=self._gap,
        )
        for law, rows in self._laws:
            found = np.broadcast_to(law(at, self._p), signals.shape[1:])
            for row, sign in rows:
                tau[row] += sign * found[0].real
            if by_state is None:
                continue
            slopes = found[1:].imag / STEP
            by_columns = slopes[:-1].copy()
            if self._weight is None:
                by_columns[:4] += slopes[-1] * self._spring
            for row, sign in rows:
                # a rigid joint has link and motor in the same columns
                np.add.at(by_state[row], self._columns, sign * by_columns)
                if self._weight is not None and slopes[-1] != 0.0:
                    by_q = self._weight.slopes(x[None], self._values)[0, self._joint]
                    by_state[row, self._q_link] += sign * slopes[-1] * by_q


class LawBehindTransmission:
    """A law that sees the links as the motors do.

    Args:
        law: the law.
        S, R: of `Transmission.maps`.
    """

    def __init__(self, law: LawAtOneState, S: Array, R: Array):
        self._law, self._S, self._R = law, S, R

    def add(self, x: Array, tau: Array, by_state: Array | None) -> None:
        """Adds the torques; see `LawAtOneState`."""
        own = np.zeros_like(tau)
        by_own = None if by_state is None else np.zeros_like(by_state)
        self._law.add(self._S @ x, own, by_own)
        tau += self._R @ own
        if by_state is not None and by_own is not None:
            by_state += self._R @ by_own @ self._S


class CoupledLawAtOneState:
    """A law of several joints.

    Args:
        here: the effect, of kind RobotTorque.
        robot: the robot.
        springs: of the base model, for stiffness and damping.
        values: all parameters by full name.
    """

    def __init__(self, here: EffectAt, robot: Robot, springs: Springs, values: Mapping[str, float]):
        assert isinstance(here.effect, RobotTorque)
        layout, self._law, self._p = robot.layout, here.effect.law, here.own(values)
        self._columns = np.concatenate([layout.joint_q, layout.joint_v, layout.motor_q, layout.motor_v])
        self._rows = layout.joint_link, layout.motor_row
        self._fixed: dict[str, Any] = {
            "stiffness": springs.stiffness,
            "damping": springs.damping,
            "joints": robot.joints,
            "owner": robot.joints.index(here.owner) if here.owner in robot.joints else 0,
            "sharpness": robot.friction_sharpness(values),
        }
        k = len(self._columns)
        self._moves = 1j * STEP * np.vstack([np.zeros((1, k)), np.eye(k)])

    def add(self, x: Array, tau: Array, by_state: Array | None) -> None:
        """Adds the torques; see `LawAtOneState`."""
        signals = x[self._columns][None]
        if by_state is not None:
            signals = signals + self._moves
        q_link, v_link, q_motor, v_motor = np.split(signals, 4, axis=1)
        at = RobotSignals(q_link=q_link, v_link=v_link, q_motor=q_motor, v_motor=v_motor, **self._fixed)
        for rows, torque in zip(self._rows, self._law(at, self._p), strict=True):
            found = np.broadcast_to(torque, q_link.shape)
            np.add.at(tau, rows, found[0].real)
            if by_state is not None:
                for j, row in enumerate(rows.tolist()):
                    np.add.at(by_state[row], self._columns, found[1:, j].imag / STEP)
