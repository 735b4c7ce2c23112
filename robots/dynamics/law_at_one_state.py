# SPDX-License-Identifier: BSD-3-Clause
"""Torque laws of effects at one state: value and all slopes from one evaluation of the law.

The law gets its signals side by side, the first set as they are and one more for each signal, moved by i 1e-30: the
real part of the first is the torque, the imaginary parts of the others are the slopes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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


class JointLawsAtOneState:
    """One law at several joints, evaluated side by side.

    Args:
        here: the effect at each joint, of kind JointTorque; all of them `alike`.
        robot: the robot.
        springs: of the base model, for stiffness and damping.
        values: all parameters by full name.
        sharpness: k of the friction law of each joint, shape (n,) [s/rad]; may change.
    """

    def __init__(
        self,
        here: Sequence[EffectAt],
        robot: Robot,
        springs: Springs,
        values: Mapping[str, float],
        sharpness: Array,
    ):
        effect, layout = here[0].effect, robot.layout
        assert isinstance(effect, JointTorque)
        joints = [robot.joints.index(one.owner) for one in here]
        self._joints, self._sharpness = np.array(joints), sharpness
        own = [one.own(values) for one in here]
        # a law of one joint gets numbers, as it is written
        self._p = own[0] if len(here) == 1 else {name: np.array([p[name] for p in own]) for name in own[0]}
        gaps = [effect.behind(robot.effects, one.owner) for one in here]
        self._gap = tuple(np.array([values[name] for name in names]) for names in zip(*gaps, strict=True)) or None
        link, motor = layout.joint_link[joints], layout.motor_row[joints]
        sides = {"link": [(link, 1.0)], "motor": [(motor, 1.0)], "spring": [(link, -1.0), (motor, 1.0)]}
        self._laws: list[tuple[Law, list[tuple[Any, float]]]] = [(effect.law, sides[effect.side])]
        columns = [layout.joint_q[joints], layout.joint_v[joints], layout.motor_q[joints], layout.motor_v[joints]]
        if effect.memory is not None:
            index = np.array([layout.memories.index(one.label) for one in here])
            columns.append(layout.memory.start + index)
            self._laws.append((effect.memory.rate, [(layout.n_link + layout.n_motor + index, 1.0)]))
        self._columns = np.array(columns, dtype=np.intp)
        # a rigid joint has link and motor in the same columns
        self._apart = all(len(set(own)) == len(own) for own in self._columns.T.tolist())
        self._stiffness, damping = springs.stiffness[joints], springs.damping[joints]
        self._weight, self._values = CarriedWeight(robot).on(here[0].owner, effect, own[0]), values
        self._q_link = layout.q_link
        # torque of the spring by (q_link, v_link, q_motor, v_motor); a set of signals for each and for the torque
        self._spring = np.array([self._stiffness, damping, -self._stiffness, -damping])
        count = len(columns) + 1
        self._moves = (1j * STEP * np.hstack([np.zeros((count, 1)), np.eye(count)]))[:, :, None]

    def add(self, x: Array, tau: Array, by_state: Array | None) -> None:
        """Adds the torques, and the rates of memories; see `LawAtOneState`."""
        own, count = x[self._columns], len(self._columns)
        signals: NDArray[Any] = np.empty((count + 1, 1, len(self._joints)))
        signals[:count, 0] = own
        if self._weight is None:
            signals[count, 0] = (self._spring * own[:4]).sum(axis=0)
        else:
            signals[count, 0] = self._weight.torque(x[None], self._values)[0, self._joints]
        if by_state is not None:
            signals = signals + self._moves
        q_link, v_link, q_motor, v_motor = signals[:4]
        at = JointSignals(
            q_link=q_link,
            v_link=v_link,
            q_motor=q_motor,
            v_motor=v_motor,
            tau_spring=signals[count],
            stiffness=self._stiffness,
            sharpness=self._sharpness[self._joints],
            memory=signals[4] if count > 4 else 0.0,
            gap=self._gap,
        )
        for law, sides in self._laws:
            found = np.broadcast_to(law(at, self._p), signals.shape[1:])
            for rows, sign in sides:
                tau[rows] += sign * found[0].real
            if by_state is not None:
                self._add_slopes(x, found[1:].imag / STEP, sides, by_state)

    def _add_slopes(self, x: Array, slopes: Array, sides: list[tuple[Any, float]], by_state: Array) -> None:
        """Adds the derivatives of a law by its signals, shape (count + 1, k), to those by the state."""
        by_columns, by_load = slopes[:-1], slopes[-1]
        if self._weight is None:
            by_columns = by_columns.copy()
            by_columns[:4] += by_load * self._spring
        for rows, sign in sides:
            if self._apart:
                by_state[rows, self._columns] += sign * by_columns
            else:
                np.add.at(by_state, (np.broadcast_to(rows, self._columns.shape), self._columns), sign * by_columns)
            if self._weight is not None and by_load.any():
                by_q = self._weight.slopes(x[None], self._values)[0, self._joints]
                by_state[rows, self._q_link] += sign * by_load[:, None] * by_q


def side_by_side(
    effects: Sequence[EffectAt], robot: Robot, springs: Springs, values: Mapping[str, float], sharpness: Array
) -> list[LawAtOneState]:
    """Joint laws, those of one kind at several joints together where the law takes arrays of parameters.

    Arguments as of `JointLawsAtOneState`.
    """
    groups: dict[Any, list[EffectAt]] = {}
    weight = CarriedWeight(robot)
    for here in effects:
        assert isinstance(here.effect, JointTorque)
        gap = here.effect.behind(robot.effects, here.owner)
        carried = weight.on(here.owner, here.effect, here.own(values)) is not None
        groups.setdefault((id(here.effect), len(gap), carried), []).append(here)
    found: list[LawAtOneState] = []
    for group in groups.values():
        together = [group] if len(group) == 1 or _takes_arrays(group, values) else [[here] for here in group]
        found += [JointLawsAtOneState(some, robot, springs, values, sharpness) for some in together]
    return found


def _takes_arrays(here: Sequence[EffectAt], values: Mapping[str, float]) -> bool:
    """Whether a law says the same of several joints at once as of each: one that asks `if` of a parameter does not."""
    effect = here[0].effect
    assert isinstance(effect, JointTorque)
    own = [one.own(values) for one in here]
    together = {name: np.array([p[name] for p in own]) for name in own[0]}
    seen: dict[str, Any] = dict(q_link=0.31, v_link=0.7, q_motor=0.3, v_motor=-0.4, tau_spring=0.9, stiffness=40.0)
    seen |= dict(memory=0.2)
    for law in [effect.law] if effect.memory is None else [effect.law, effect.memory.rate]:
        each = [law(JointSignals(**seen), p) for p in own]
        try:
            all_at_once = np.broadcast_to(law(JointSignals(**seen), together), len(own))
        except (TypeError, ValueError):
            return False
        if not np.allclose(all_at_once, each, rtol=1e-12, atol=0.0, equal_nan=True):
            return False
    return True


class LawsBehindTransmission:
    """Laws that see the links as the motors do.

    Args:
        laws: the laws.
        S, R: of `Transmission.maps`.
    """

    def __init__(self, laws: Sequence[LawAtOneState], S: Array, R: Array):
        self._laws, self._S, self._R = laws, S, R

    def add(self, x: Array, tau: Array, by_state: Array | None) -> None:
        """Adds the torques; see `LawAtOneState`."""
        own = np.zeros_like(tau)
        by_own = None if by_state is None else np.zeros_like(by_state)
        seen = self._S @ x
        for law in self._laws:
            law.add(seen, own, by_own)
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
        sharpness: k of the friction law of each joint, shape (n,) [s/rad]; may change.
    """

    def __init__(self, here: EffectAt, robot: Robot, springs: Springs, values: Mapping[str, float], sharpness: Array):
        assert isinstance(here.effect, RobotTorque)
        layout, self._law, self._p = robot.layout, here.effect.law, here.own(values)
        self._columns = np.concatenate([layout.joint_q, layout.joint_v, layout.motor_q, layout.motor_v])
        self._rows = layout.joint_link, layout.motor_row
        self._fixed: dict[str, Any] = {
            "stiffness": springs.stiffness,
            "damping": springs.damping,
            "joints": robot.joints,
            "owner": robot.joints.index(here.owner) if here.owner in robot.joints else 0,
            "sharpness": sharpness,
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
