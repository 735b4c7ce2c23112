# SPDX-License-Identifier: BSD-3-Clause
"""The torques of a robot's effects with exact derivatives: laws are evaluated with complex steps.

A derivative by one signal costs one evaluation of the law with that signal moved by i 1e-30; what a law does not
depend on is found once, when the robot is built, and costs nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, Law
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque
from jointscope.robots.state_layout import StateLayout
from jointscope.robots.torque_terms import TorqueTerms

Array = NDArray[np.float64]
STEP = 1e-30
SIGNALS = ("q_link", "v_link", "q_motor", "v_motor", "tau_spring", "stiffness", "memory")


@dataclass(frozen=True)
class Springs:
    """Springs of all joints at m samples; zero for rigid joints.

    Attributes:
        stiffness, damping: shape (n,) [N m/rad], [N m s/rad].
        deflection, rate: shape (m, n) [rad], [rad/s].
        torque: shape (m, n) [N m].
        stiffness_by, damping_by: index among the free parameters and derivative by it, for each joint; -1 for none.
    """

    stiffness: Array
    damping: Array
    deflection: Array
    rate: Array
    torque: Array
    stiffness_by: Sequence[tuple[int, float]]
    damping_by: Sequence[tuple[int, float]]


class EffectTorques:
    """All torque laws among a robot's effects.

    Args:
        effects: effects of the robot.
        joints: names of the joints.
        layout: of the state.
        names: names of the free parameters.
        sharpness: of the base model's friction [s/rad].
    """

    def __init__(
        self,
        effects: Sequence[EffectAt],
        joints: tuple[str, ...],
        layout: StateLayout,
        names: tuple[str, ...],
        sharpness: float,
    ):
        self._layout, self._names, self._joints, self._sharpness = layout, names, joints, sharpness
        self._local = [
            _LocalLaw(here, joints, layout, names) for here in effects if isinstance(here.effect, JointTorque)
        ]
        self._global = [here for here in effects if isinstance(here.effect, RobotTorque)]

    def add(self, terms: TorqueTerms, x: Array, springs: Springs, values: Mapping[str, float]) -> None:
        """Adds all torques and rates of memories.

        Args:
            terms: receives them.
            x: states, shape (m, d).
            springs: springs of the base model.
            values: all parameters of the robot by full name.
        """
        for law in self._local:
            law.add(terms, x, springs, values, self._sharpness)
        for here in self._global:
            self._add_global(terms, here, x, springs, values)

    def _add_global(
        self, terms: TorqueTerms, here: EffectAt, x: Array, springs: Springs, values: Mapping[str, float]
    ) -> None:
        layout, effect = self._layout, here.effect
        assert isinstance(effect, RobotTorque)
        columns = {
            "q_link": layout.joint_q,
            "v_link": layout.joint_v,
            "q_motor": layout.motor_q,
            "v_motor": layout.motor_v,
        }
        signals = RobotSignals(
            **{name: x[:, c] for name, c in columns.items()},
            **{"stiffness": springs.stiffness, "damping": springs.damping, "joints": self._joints},
            **{
                "owner": self._joints.index(here.owner) if here.owner in self._joints else 0,
                "sharpness": self._sharpness,
            },
        )
        p = _own(here, values)
        rows = (layout.joint_link, _motor_rows(layout))

        def put(target: Array, torques: tuple[Any, Any]) -> None:
            for side, torque in zip(rows, torques, strict=True):
                np.add.at(target, (slice(None), side), torque)

        put(terms.value, effect.law(signals, p))
        if terms.by_state is None or terms.by_parameter is None:
            return
        for name, c in columns.items():
            for j in range(len(self._joints)):
                moved = getattr(signals, name).astype(complex)
                moved[:, j] += 1j * STEP
                put(terms.by_state[:, :, c[j]], _imaginary(effect.law(replace(signals, **{name: moved}), p)))
        for name, by in (("stiffness", springs.stiffness_by), ("damping", springs.damping_by)):
            for j, (index, slope) in enumerate(by):
                if index >= 0:
                    moved = getattr(signals, name).astype(complex)
                    moved[j] += 1j * STEP
                    change = _imaginary(effect.law(replace(signals, **{name: moved}), p))
                    put(terms.by_parameter[:, :, index], (slope * change[0], slope * change[1]))
        for name, value in p.items():
            full = here.parameter(name)
            if full in self._names:
                change = _imaginary(effect.law(signals, {**p, name: value + 1j * STEP}))
                put(terms.by_parameter[:, :, self._names.index(full)], change)


class _LocalLaw:
    """One effect of one joint."""

    def __init__(self, here: EffectAt, joints: tuple[str, ...], layout: StateLayout, names: tuple[str, ...]):
        assert isinstance(here.effect, JointTorque)
        self.here, self.effect = here, here.effect
        j = self.joint = joints.index(here.owner)
        self._columns = {
            **{"q_link": int(layout.joint_q[j]), "v_link": int(layout.joint_v[j])},
            **{"q_motor": int(layout.motor_q[j]), "v_motor": int(layout.motor_v[j])},
        }
        link, motor = int(layout.joint_link[j]), int(_motor_rows(layout)[j])
        self._rows = {"link": ((link, 1.0),), "motor": ((motor, 1.0),), "spring": ((link, -1.0), (motor, 1.0))}[
            here.effect.side
        ]
        self._memory_row = -1
        if here.effect.memory is not None:
            index = layout.memories.index(here.label)
            self._columns["memory"] = layout.memory.start + index
            self._memory_row = layout.n_link + layout.n_motor + index
        self._names = {name.rsplit(".", 1)[1]: k for k, name in enumerate(names) if name.startswith(here.parameter(""))}

    def add(
        self, terms: TorqueTerms, x: Array, springs: Springs, values: Mapping[str, float], sharpness: float
    ) -> None:
        """Adds the torque, and the rate of the memory."""
        j = self.joint
        signals = JointSignals(
            **{name: x[:, column] for name, column in self._columns.items()},
            **{"tau_spring": springs.torque[:, j], "stiffness": springs.stiffness[j], "sharpness": sharpness},
        )
        p = _own(self.here, values)
        self._add_law(terms, self.effect.law, self._rows, signals, p, springs)
        if self.effect.memory is not None:
            self._add_law(terms, self.effect.memory.rate, ((self._memory_row, 1.0),), signals, p, springs)

    def _add_law(
        self,
        terms: TorqueTerms,
        law: Law,
        rows: tuple[tuple[int, float], ...],
        signals: JointSignals,
        p: dict[str, float],
        springs: Springs,
    ) -> None:
        value = np.real(law(signals, p))
        for row, sign in rows:
            terms.value[:, row] += sign * value
        if terms.by_state is None or terms.by_parameter is None:
            return
        j = self.joint
        for name in SIGNALS:
            if name == "memory" and self._memory_row < 0:
                continue
            slope = np.imag(law(replace(signals, **{name: getattr(signals, name) + 1j * STEP}), p)) / STEP
            if not np.any(slope):
                continue
            for row, sign in rows:
                self._chain(terms, row, name, sign * slope, springs, j)
        for name, index in self._names.items():
            slope = np.imag(law(signals, {**p, name: p[name] + 1j * STEP})) / STEP
            for row, sign in rows:
                terms.by_parameter[:, row, index] += sign * slope

    def _chain(self, terms: TorqueTerms, row: int, name: str, slope: Array, springs: Springs, j: int) -> None:
        """Passes a derivative by one signal on to the state and to the parameters of the spring."""
        assert terms.by_state is not None and terms.by_parameter is not None
        if name in self._columns:
            terms.by_state[:, row, self._columns[name]] += slope
        elif name == "stiffness":
            index, factor = springs.stiffness_by[j]
            if index >= 0:
                terms.by_parameter[:, row, index] += slope * factor
        else:
            K, D, column = springs.stiffness[j], springs.damping[j], self._columns
            for at, by in (("q_link", K), ("q_motor", -K), ("v_link", D), ("v_motor", -D)):
                terms.by_state[:, row, column[at]] += slope * by
            for (index, factor), signal in (
                (springs.stiffness_by[j], springs.deflection),
                (springs.damping_by[j], springs.rate),
            ):
                if index >= 0:
                    terms.by_parameter[:, row, index] += slope * factor * signal[:, j]


def _own(here: EffectAt, values: Mapping[str, float]) -> dict[str, float]:
    """The effect's own parameters by the last part of their name."""
    start = here.parameter("")
    return {name[len(start) :]: value for name, value in values.items() if name.startswith(start)}


def _motor_rows(layout: StateLayout) -> NDArray[np.intp]:
    """Equation in which each motor's torque stands: its own, or that of the link where the joint is rigid."""
    own = [
        layout.n_link + layout.motors.index(j) if j in layout.motors else layout.links.index(j) for j in layout.joints
    ]
    return np.array(own, dtype=np.intp)


def _imaginary(torques: tuple[Any, Any]) -> tuple[Any, Any]:
    return np.imag(torques[0]) / STEP, np.imag(torques[1]) / STEP
