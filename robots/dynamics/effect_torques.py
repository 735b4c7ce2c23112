# SPDX-License-Identifier: BSD-3-Clause
"""The torques of a robot's effects with exact derivatives: laws are evaluated with complex steps.

A derivative by one signal costs one evaluation of the law with that signal moved by i 1e-30; what a law does not
depend on is found once, when the robot is built, and costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.carried_weight import CarriedWeight
from jointscope.robots.dynamics.joint_springs import Springs
from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, Law, signals_used
from jointscope.robots.effect_kinds.robot_torque import RobotSignals, RobotTorque
from jointscope.robots.model.robot import SHARPNESS
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]
STEP = 1e-30


class EffectTorques:
    """All torque laws among a robot's effects.

    Args:
        effects: effects of the robot.
        joints: names of the joints.
        layout: of the state.
        names: names of the free parameters.
        sharpness: of the base model's friction for given parameters, shape (n,) [s/rad].
        weight: what gears carry, for laws that ask for it.
    """

    def __init__(
        self,
        effects: Sequence[EffectAt],
        joints: tuple[str, ...],
        layout: StateLayout,
        names: tuple[str, ...],
        sharpness: Callable[[Mapping[str, float]], Array],
        weight: CarriedWeight,
    ):
        self._layout, self._names, self._joints, self._sharpness = layout, names, joints, sharpness
        self._local = [
            _LocalLaw(here, joints, layout, names, weight, here.effect.behind(effects, here.owner))
            for here in effects
            if isinstance(here.effect, JointTorque)
        ]
        self._global = [here for here in effects if isinstance(here.effect, RobotTorque)]
        self._weight = weight if any(law.on_weight for law in self._local) else None

    def add(
        self,
        terms: TorqueTerms,
        x: Array,
        springs: Springs,
        values: Mapping[str, float],
        outside: Array | None = None,
        sharpness: Array | None = None,
    ) -> None:
        """Adds all torques and rates of memories.

        Args:
            terms: receives them.
            x: states, shape (m, d).
            springs: springs of the base model.
            values: all parameters of the robot by full name.
            outside: torques of known loads about the joints, shape (m, n) [N m].
            sharpness: another one than that of the robot, shape (n,) or (m, n) [s/rad].
        """
        sharpness = self._sharpness(values) if sharpness is None else sharpness
        carried = None
        if self._weight is not None:
            slopes, w = terms.by_state is not None, self._weight
            by_q = w.slopes(x, values) if slopes else None
            by_parameter = w.by_parameter(x, values, outside) if slopes else {}
            carried = Carried(w.torque(x, values, outside), by_q, by_parameter)
        for law in self._local:
            law.add(terms, x, springs, values, sharpness[..., law.joint], carried)
        for here in self._global:
            own = sharpness if sharpness.ndim == 1 else self._sharpness(values)
            self._add_global(terms, here, here.own(values), self._signals(here, x, springs, own), springs)

    def _add_global(
        self, terms: TorqueTerms, here: EffectAt, p: dict[str, float], signals: RobotSignals, springs: Springs
    ) -> None:
        effect = here.effect
        assert isinstance(effect, RobotTorque)
        self._put(terms.value, effect.law(signals, p))
        if terms.by_state is None or terms.by_parameter is None:
            return
        for name, columns in self._columns.items():
            for j, column in enumerate(columns):
                moved = getattr(signals, name).astype(complex)
                moved[:, j] += 1j * STEP
                change = _imaginary(effect.law(replace(signals, **{name: moved}), p))
                self._put(terms.by_state[:, :, column], change)
        for name, by in (("stiffness", springs.stiffness_by), ("damping", springs.damping_by)):
            for j, (index, slope) in enumerate(by):
                if index >= 0:
                    moved = getattr(signals, name).astype(complex)
                    moved[j] += 1j * STEP
                    change = _imaginary(effect.law(replace(signals, **{name: moved}), p))
                    self._put(terms.by_parameter[:, :, index], (slope * change[0], slope * change[1]))
        for j, joint in enumerate(self._joints):
            if f"{joint}.{SHARPNESS}" in self._names:
                moved = signals.sharpness.astype(complex)
                moved[j] += 1j * STEP
                change = _imaginary(effect.law(replace(signals, sharpness=moved), p))
                self._put(terms.by_parameter[:, :, self._names.index(f"{joint}.{SHARPNESS}")], change)
        for name, value in p.items():
            full = here.parameter(name)
            if full in self._names:
                change = _imaginary(effect.law(signals, {**p, name: value + 1j * STEP}))
                self._put(terms.by_parameter[:, :, self._names.index(full)], change)

    @property
    def _columns(self) -> dict[str, list[int]]:
        """Columns of every signal of the joints."""
        layout = self._layout
        places = {
            "q_link": layout.joint_q,
            "v_link": layout.joint_v,
            "q_motor": layout.motor_q,
            "v_motor": layout.motor_v,
        }
        return {name: columns.tolist() for name, columns in places.items()}

    def _signals(self, here: EffectAt, x: Array, springs: Springs, sharpness: Array) -> RobotSignals:
        layout = self._layout
        return RobotSignals(
            q_link=x[:, layout.joint_q],
            v_link=x[:, layout.joint_v],
            q_motor=x[:, layout.motor_q],
            v_motor=x[:, layout.motor_v],
            stiffness=springs.stiffness,
            damping=springs.damping,
            joints=self._joints,
            owner=self._joints.index(here.owner) if here.owner in self._joints else 0,
            sharpness=sharpness,
        )

    def _put(self, target: Array, torques: tuple[Any, Any]) -> None:
        """Adds torques of the links and of the motors, shape (m, n) each, to their equations, shape (m, r)."""
        for rows, torque in zip((self._layout.joint_link, self._layout.motor_row), torques, strict=True):
            for j, row in enumerate(rows.tolist()):
                target[:, row] += torque[:, j]


@dataclass(frozen=True)
class Carried:
    """What gears carry at m samples.

    Attributes:
        torque: shape (m, n) [N m].
        by_q: by the positions of the links, shape (m, n, n_link); None where no derivatives are wanted.
        by_parameter: by free parameters, by index, shape (m, n).
    """

    torque: Array
    by_q: Array | None
    by_parameter: Mapping[int, Array]


class _LocalLaw:
    """One effect of one joint."""

    def __init__(
        self,
        here: EffectAt,
        joints: tuple[str, ...],
        layout: StateLayout,
        names: tuple[str, ...],
        weight: CarriedWeight,
        gap: tuple[str, ...],
    ):
        assert isinstance(here.effect, JointTorque)
        self.here, self.effect, self._gap = here, here.effect, gap
        j = self.joint = joints.index(here.owner)
        some = {p.name: p.start for p in here.effect.parameters}
        self.on_weight = weight.on(here.owner, here.effect, some) is not None
        laws = [here.effect.law] if here.effect.memory is None else [here.effect.law, here.effect.memory.rate]
        self._used = {law: signals_used(law, some) for law in laws}
        self._q_link = layout.q_link
        at = {"q_link": layout.joint_q, "v_link": layout.joint_v, "q_motor": layout.motor_q, "v_motor": layout.motor_v}
        self._columns = {signal: int(columns[j]) for signal, columns in at.items()}
        link, motor = int(layout.joint_link[j]), int(layout.motor_row[j])
        rows = {"link": ((link, 1.0),), "motor": ((motor, 1.0),), "spring": ((link, -1.0), (motor, 1.0))}
        self._rows = rows[here.effect.side]
        self._memory_row = -1
        if here.effect.memory is not None:
            index = layout.memories.index(here.label)
            self._columns["memory"] = layout.memory.start + index
            self._memory_row = layout.n_link + layout.n_motor + index
        self._sharpness = next((k for k, name in enumerate(names) if name == f"{here.owner}.{SHARPNESS}"), None)
        self._ends = [(end, names.index(name)) for end, name in enumerate(gap) if name in names]
        self._own: dict[str, str] = {}  # names are the same whenever values come
        self._names = {name.rsplit(".", 1)[1]: k for k, name in enumerate(names) if name.startswith(here.parameter(""))}

    def add(
        self,
        terms: TorqueTerms,
        x: Array,
        springs: Springs,
        values: Mapping[str, float],
        sharpness: Array,
        carried: Carried | None,
    ) -> None:
        """Adds the torque, and the rate of the memory."""
        j = self.joint
        signals: dict[str, Any] = {name: x[:, column] for name, column in self._columns.items()}
        carried = carried if self.on_weight else None
        load = springs.torque[:, j] if carried is None else carried.torque[:, j]
        signals |= {"tau_spring": load, "stiffness": springs.stiffness[j]}
        signals |= {"sharpness": sharpness, "gap": tuple(values[name] for name in self._gap) or None}
        self._own = self._own or self.here.own_names(values)
        p = {name: values[full] for name, full in self._own.items()}
        self._add_law(terms, self.effect.law, self._rows, signals, p, springs, carried)
        if self.effect.memory is not None:
            self._add_law(terms, self.effect.memory.rate, ((self._memory_row, 1.0),), signals, p, springs, carried)

    def _add_law(
        self,
        terms: TorqueTerms,
        law: Law,
        rows: tuple[tuple[int, float], ...],
        signals: dict[str, Any],
        p: dict[str, float],
        springs: Springs,
        carried: Carried | None,
    ) -> None:
        here = JointSignals(**signals)
        value = np.real(law(here, p))
        for row, sign in rows:
            terms.value[:, row] += sign * value
        if terms.by_state is None or terms.by_parameter is None:
            return
        j = self.joint
        for name in self._used[law]:
            if name == "memory" and self._memory_row < 0:
                continue
            slope = self._slope(law, signals, name, p)
            if not np.any(slope):
                continue
            if name == "tau_spring" and carried is not None and carried.by_q is not None:
                for row, sign in rows:
                    terms.by_state[:, row, self._q_link] += sign * slope[:, None] * carried.by_q[:, j]
                    for index, by in carried.by_parameter.items():
                        terms.by_parameter[:, row, index] += sign * slope * by[:, j]
                continue
            for row, sign in rows:
                self._chain(terms, row, name, sign * slope, springs, j)
        slopes = [] if self._sharpness is None else [(self._sharpness, self._slope(law, signals, "sharpness", p))]
        for end, index in self._ends:
            moved = tuple(value + 1j * STEP * (k == end) for k, value in enumerate(signals["gap"]))
            slopes.append((index, np.imag(law(JointSignals(**{**signals, "gap": moved}), p)) / STEP))
        for name, index in self._names.items():
            slopes.append((index, np.imag(law(here, {**p, name: p[name] + 1j * STEP})) / STEP))
        for (index, slope), (row, sign) in product(slopes, rows):
            terms.by_parameter[:, row, index] += sign * slope

    @staticmethod
    def _slope(law: Law, signals: dict[str, Any], name: str, p: dict[str, float]) -> Array:
        """Derivative of a law by one signal, shape (m,)."""
        # made anew: `replace` takes longer than many a law
        moved = JointSignals(**{**signals, name: signals[name] + 1j * STEP})
        return np.asarray(np.imag(law(moved, p)) / STEP)

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


def _imaginary(torques: tuple[Any, Any]) -> tuple[Any, Any]:
    return np.imag(torques[0]) / STEP, np.imag(torques[1]) / STEP
