# SPDX-License-Identifier: BSD-3-Clause
"""Checks an effect that the package does not know: what its author may have overlooked shows here, not in a result."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from jointscope.robots.effect_kinds.effect import OWNER_KINDS, Effect, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import SIDES, JointSignals, JointTorque
from jointscope.robots.effect_kinds.structure import FORMS, Structure
from jointscope.robots.errors import EffectError

NAME = re.compile(r"[a-z][a-z0-9_]*")
SIGNS = ("+", "+-")
STEP = 1e-30
SIGNALS = ("q_link", "v_link", "q_motor", "v_motor", "tau_spring", "sharpness")


def check_effect(effect: Effect, place: str) -> None:
    """Checks names, owners, parameters and, for a torque of a joint, the law itself.

    Args:
        effect: the effect.
        place: where it was made, for messages.

    Raises:
        EffectError: something cannot be; the message says what was expected.
    """
    if not isinstance(effect.id, str) or not NAME.fullmatch(effect.id):
        raise EffectError(f"{place}: id: expected lower-case letters, digits and _, got {effect.id!r}")
    here = f"{place}: {effect.id}"
    wrong = [kind for kind in effect.owners if kind not in OWNER_KINDS]
    if wrong or not effect.owners:
        raise EffectError(f"{here}: owners: expected some of {', '.join(OWNER_KINDS)}, got {effect.owners!r}")
    names = [parameter.name for parameter in effect.parameters]
    if len(set(names)) != len(names):
        raise EffectError(f"{here}: parameters: expected different names, got {', '.join(names)}")
    for parameter in effect.parameters:
        _check_parameter(parameter, here)
    unknown = [name for name in effect.example if name not in names]
    if unknown:
        raise EffectError(f"{here}: example: no parameter {unknown[0]!r}; it has {', '.join(names) or 'none'}")
    if isinstance(effect, Structure) and effect.form not in FORMS:
        raise EffectError(f"{here}: form: expected one of {', '.join(FORMS)}, got {effect.form!r}")
    if isinstance(effect, JointTorque):
        _check_torque(effect, here)


def null_values(parameters: tuple[EffectParameter, ...]) -> dict[str, float]:
    """Parameters at which an effect vanishes; shapes, which have no null, at their start."""
    return {p.name: p.start if p.is_shape else p.null for p in parameters}


def _check_parameter(p: EffectParameter, here: str) -> None:
    where = f"{here}: parameter {p.name!r}"
    if not NAME.fullmatch(p.name):
        raise EffectError(f"{where}: expected lower-case letters, digits and _")
    if not p.unit:
        raise EffectError(f"{where}: unit: expected a text such as 'N m', or '1' for a pure number")
    if p.sign not in SIGNS:
        raise EffectError(f"{where}: sign: expected '+' or '+-', got {p.sign!r}")
    if not np.all(np.isfinite([p.start, p.prior_sigma, p.null, *p.grid])) or p.prior_sigma <= 0:
        raise EffectError(f"{where}: expected finite numbers and a prior_sigma above zero")
    if p.logarithmic and (p.start <= 0 or any(value <= 0 for value in p.grid)):
        raise EffectError(f"{where}: a logarithmic parameter starts above zero, got {p.start:g}")


def _check_torque(effect: JointTorque, here: str) -> None:
    """The law runs for complex numbers, gives one torque per sample, vanishes at null and depends on nothing else."""
    if effect.side not in SIDES:
        raise EffectError(f"{here}: side: expected one of {', '.join(SIDES)}, got {effect.side!r}")
    signals = _sample_signals()
    null = null_values(effect.parameters)
    torque = _run(lambda: effect.law(signals, null), here, "law")
    if np.any(np.real(torque) != 0.0):
        raise EffectError(f"{here}: law: expected no torque at the null values, got {np.abs(torque).max():.3g} N m")
    values = {**{p.name: p.start for p in effect.parameters}, **effect.example}
    _check_complex(lambda s: _run(lambda: effect.law(s, values), here, "law"), signals, here)
    if effect.memory is not None:
        rate = effect.memory.rate
        _run(lambda: rate(signals, values), here, "rate of the memory")


def _run(law: Callable[[], object], here: str, name: str) -> np.ndarray:
    """The result of a law as an array of the right shape."""
    try:
        result = np.asarray(law())
    except Exception as err:
        text = " ".join(str(err).split())
        raise EffectError(f"{here}: {name}: {type(err).__name__}: {text}; it gets signals and a mapping") from err
    shape = _sample_signals().v_motor.shape
    if result.shape not in (shape, ()) or not np.all(np.isfinite(result)):
        raise EffectError(f"{here}: {name}: expected finite numbers of shape {shape}, got shape {result.shape}")
    return result


def _check_complex(law: Callable[[JointSignals], np.ndarray], signals: JointSignals, here: str) -> None:
    """Compares complex steps with differences: abs, sign and comparisons lose the derivative without a word."""
    for name in SIGNALS:
        parts = {signal: getattr(signals, signal) for signal in SIGNALS}
        exact = np.imag(law(_with(signals, {**parts, name: parts[name] + 1j * STEP}))) / STEP
        h = 1e-7
        up, down = (np.real(law(_with(signals, {**parts, name: parts[name] + side}))) for side in (h, -h))
        near = (up - down) / (2.0 * h)
        if np.any(np.abs(exact - near) > 1e-3 * np.abs(near).max() + 1e-5):
            raise EffectError(
                f"{here}: law: its derivative by {name} is lost in complex numbers; use smooth_abs, smooth_sign and "
                "np functions instead of abs, sign and comparisons"
            )


def _with(signals: JointSignals, parts: dict[str, Any]) -> JointSignals:
    return JointSignals(**parts, stiffness=signals.stiffness, memory=signals.memory)


def _sample_signals() -> JointSignals:
    """A few samples of a motion in which nothing is zero."""
    rng = np.random.default_rng(7)
    q, v, deflection, rate, memory = rng.uniform(0.1, 0.9, (5, 6)) * rng.choice([-1.0, 1.0], (5, 6))
    stiffness, damping = 200.0, 5.0
    return JointSignals(
        q_link=q + 0.05 * deflection,
        v_link=v + 0.1 * rate,
        q_motor=q,
        v_motor=v,
        tau_spring=stiffness * 0.05 * deflection + damping * 0.1 * rate,
        stiffness=stiffness,
        sharpness=20.0,
        memory=memory,
    )
