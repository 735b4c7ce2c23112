# SPDX-License-Identifier: BSD-3-Clause
"""The law of an effect as a picture: its torque at the sizes of its example, at half and at twice of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Effect
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, signals_used
from jointscope.tools.report.page.picture import picture
from jointscope.tools.report.page.plot import Axes, Curve, Mark, plot

Array = NDArray[np.float64]

MOTION = ("q_link", "v_link", "q_motor", "v_motor", "tau_spring")
SIZES = {"half": 0.5, "the example": 1.0, "twice": 2.0}
STIFFNESS = 150.0  # [N m/rad] of the spring on which laws of springs are drawn
SPEED, SWING, BEND, LOAD = 1.0, np.pi, 0.05, 20.0  # [rad/s], [rad], [rad], [N m] to either side
SCALES = 4.0  # times a parameter that is a speed or an angle
PERIODS = 2.0  # of a ripple
POINTS = 801
CYCLE = 2.0 * np.pi  # [s] of the motion that a law with a memory is drawn along
WIDTH, HEIGHT = 640, 230


def law_picture(effect: Effect) -> str | None:
    """An SVG file; None for an effect that is no torque of one joint's motion."""
    if not isinstance(effect, JointTorque):
        return None
    example = dict(effect.example or {})
    label, x, motions = _motions(effect, example)
    marks: list[Mark] = []
    for name, size in SIZES.items():
        values = {p: v * size if _is_size(effect, p) else v for p, v in example.items()}
        for case, signals in motions.items():
            y = np.broadcast_to(np.real(effect.law(_with_memory(effect, signals, values), values)), x.shape)
            marks.append(
                Curve(
                    f"{name}{case}",
                    x,
                    np.asarray(y, float),
                    "k0" if size == 1.0 else "k1",
                    "solid" if size == 1.0 else "dashed",
                )
            )
    place = {"motor": "torque on the motor", "link": "torque on the link", "spring": "torque beside the spring's"}
    said = ", ".join(f"{name} = {value:g}" for name, value in example.items())
    limits = float(np.min(x)), float(np.max(x))
    axes = Axes(f"{place[effect.side]} [N m]: {said}; dashed: half and twice", label, WIDTH, HEIGHT, limits)
    return picture(plot(axes, marks))


def _is_size(effect: JointTorque, name: str) -> bool:
    """Whether a parameter scales the torque; others say where on the way something happens."""
    unit = next((p.unit for p in effect.parameters if p.name == name), "")
    return unit.startswith("N m") or name in ("coefficient", "quadratic", "half_gap", "forward", "backward")


def _motions(effect: JointTorque, example: Mapping[str, float]) -> tuple[str, Array, dict[str, JointSignals]]:
    """Text of the axis, what is on it, and the motions that it stands for, each with what tells it from the others."""
    used, side = {*signals_used(effect.law, example)}, np.linspace(-1.0, 1.0, POINTS)
    if effect.memory is not None:
        # a motion to and fro; what the memory was before its second cycle is forgotten
        angle = np.linspace(0.0, 2.0 * CYCLE, 2 * POINTS)
        reach = SCALES * _of_unit(effect, example, "rad", BEND / SCALES)
        bend, rate = reach * np.sin(angle), reach * np.cos(angle)
        return "deflection [rad]", bend, {"": _signals(q_link=bend, v_link=rate)}
    if "tau_spring" in used and "v_motor" in used:
        load, ones = LOAD * side, np.ones(POINTS)
        motions = {
            f", {w}": _signals(tau_spring=load, v_motor=s * ones) for w, s in (("forwards", 1), ("backwards", -1))
        }
        return "load [N m]", load, motions
    if {"q_link", "q_motor"} <= used:
        bend = SCALES * _of_unit(effect, example, "rad", BEND / SCALES) * side
        return "deflection [rad]", bend, {"": _signals(q_link=bend, tau_spring=STIFFNESS * bend)}
    if {"v_motor", "v_link"} & used:
        v = SCALES * _of_unit(effect, example, "rad/s", SPEED / SCALES) * side
        return "speed [rad/s]", v, {"": _signals(v_motor=v, v_link=v)}
    q = (PERIODS * np.pi / example["order"] if "order" in example else SWING) * side
    return "position [rad]", q, {"": _signals(q_motor=q, q_link=q)}


def _of_unit(effect: JointTorque, example: Mapping[str, float], unit: str, otherwise: float) -> float:
    return next((abs(example[p.name]) for p in effect.parameters if p.unit == unit and p.name in example), otherwise)


def _signals(**given: Any) -> JointSignals:
    zero = np.zeros_like(next(iter(given.values())))
    return JointSignals(stiffness=STIFFNESS, **{name: given.get(name, zero) for name in MOTION})


def _with_memory(effect: JointTorque, signals: JointSignals, values: Mapping[str, float]) -> JointSignals:
    """The signals with the state of a law that has one, by small steps along them."""
    if effect.memory is None:
        return signals
    n, z = len(signals.q_link), 0.0
    h, memory = 2.0 * CYCLE / (n - 1), np.zeros(n)
    for k in range(n):
        memory[k] = z
        now: dict[str, Any] = {name: getattr(signals, name)[k] for name in MOTION}
        z += h * float(np.real(effect.memory.rate(replace(signals, memory=z, **now), values)))
    return replace(signals, memory=memory)
