# SPDX-License-Identifier: BSD-3-Clause
"""Effects that are a torque of one joint, as a function of that joint's own motion: one line of numpy.

The law is written for complex numbers, so that its derivatives come exact from complex steps: use `smooth_sign`,
`smooth_abs`, np.tanh, np.exp ..., never abs, sign or comparisons of the signals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from jointscope.robots.effect_kinds.effect import Effect

if TYPE_CHECKING:
    from jointscope.robots.effect_kinds.effect_at import EffectAt
    from jointscope.robots.effect_kinds.robot_view import RobotView

GAP_CORNER = 5e-4  # [rad] over which the corners of a dead zone are rounded
SIDES = ("motor", "link", "spring")
LOADS = ("transmitted", "weight")
SHARPNESS = 200.0  # [s/rad] of tanh(k v) where the robot file does not say otherwise


@dataclass(frozen=True)
class JointSignals:
    """Motion of one joint at m samples, in link units; arrays of shape (m,), complex while derivatives are taken.

    Attributes:
        q_link, q_motor: positions [rad].
        v_link, v_motor: velocities [rad/s].
        tau_spring: load of the gear: K (q_link - q_motor) + D (v_link - v_motor) of the base model; the weight that it
            carries where the joint is rigid, or the effect asks for it [N m].
        stiffness: K [N m/rad].
        sharpness: k of the base model's friction law [s/rad]; complex while a derivative by it is wanted.
        memory: the effect's own state, if its kind has one.
        gap: dead zone in front of the spring, which its laws do not see, as `beyond_gap` takes it [rad]; None for none.
    """

    q_link: Any
    v_link: Any
    q_motor: Any
    v_motor: Any
    tau_spring: Any
    stiffness: Any
    sharpness: Any = SHARPNESS
    memory: Any = 0.0
    gap: tuple[Any, ...] | None = None

    @cached_property
    def deflection(self) -> Any:
        """q_link - q_motor, what the spring feels of it [rad]."""
        whole = self.q_link - self.q_motor
        return whole if self.gap is None else beyond_gap(whole, *self.gap)

    @property
    def deflection_rate(self) -> Any:
        """v_link - v_motor [rad/s]."""
        return self.v_link - self.v_motor


Law = Callable[[JointSignals, Mapping[str, Any]], Any]


@dataclass(frozen=True)
class Memory:
    """A state of the effect's own, z, with dz/dt = rate(signals, parameters) and z = 0 at rest.

    Attributes:
        rate: right-hand side, complex-safe.
        noise: density of the random walk that the estimator grants it [1/sqrt(s) times the unit of z].
        spread: standard deviation of z where a recording begins.
    """

    rate: Law
    noise: float
    spread: float


@dataclass(frozen=True, kw_only=True)
class JointTorque(Effect):
    """A torque added to the right-hand side of the motor's or the link's equation, or to the torque of the spring.

    Attributes:
        side: "motor": b a_motor = ... + law; "link": M a_link + ... = law; "spring": tau_c = K deflection + ... + law,
            which acts on both sides.
        law: torque [N m], shape (m,), zero at the null values; complex-safe.
        load: what `tau_spring` of an elastic joint is: the torque that the spring transmits, or the weight behind it,
            in motor coordinates; a law on the weight does not depend on the link.
        memory: the effect's own state; None for a law without memory.
        gap: names of the sizes of a dead zone in front of the spring, as `beyond_gap` takes them: other laws of the
            spring feel the deflection beyond it; empty for none.
        bends: "never" if the law is a sum of numbers and numbers times signals; "smoothly" if its slopes within a short
            step follow from those at both ends, unless dry friction turns over; else "sharply".
        curve: what it makes of a spring's curve: "terms" that add to others, or "whole" where its stiffness is all
            that may stand beside it; empty for a law that bends no spring.
    """

    side: str
    law: Law = field(repr=False)
    load: str = "transmitted"
    memory: Memory | None = None
    gap: tuple[str, ...] = ()
    bends: str = "sharply"
    curve: str = ""

    def refined(self, coarse: Any, p: Mapping[str, float]) -> dict[str, float]:
        """Values at which the law is that of a coarser member of its family at values p; none where it has none."""
        return {}

    def memory_at(self, robot: RobotView, owner: str) -> Memory | None:
        """The same at every owner."""
        return self.memory

    def behind(self, effects: Sequence[EffectAt], owner: str) -> tuple[str, ...]:
        """Full names of the sizes of the dead zone that lies before this law at an owner; empty for none."""
        if self.side != "spring" or self.gap:
            return ()
        for here in effects:
            if here.owner == owner and isinstance(here.effect, JointTorque) and here.effect.gap:
                return tuple(here.parameter(name) for name in here.effect.gap)
        return ()


SIGNALS = ("q_link", "v_link", "q_motor", "v_motor", "tau_spring", "stiffness", "memory")


def signals_used(law: Law, p: Mapping[str, Any]) -> tuple[str, ...]:
    """Those of SIGNALS that a law depends on: what is no number there is none in the result.

    Args:
        law: torque, or rate of a memory.
        p: some values of its parameters.
    """
    known: dict[str, Any] = {signal: np.full(1, 0.3 + 0.1 * k) for k, signal in enumerate(SIGNALS)}
    try:
        with np.errstate(all="ignore"):
            without = {signal: law(JointSignals(**{**known, signal: np.full(1, np.nan)}), p) for signal in SIGNALS}
    except LookupError:  # its parameters depend on the robot
        return SIGNALS
    return tuple(signal for signal, found in without.items() if np.any(np.isnan(found)))


def smooth_sign(x: Any, width: float) -> Any:
    """tanh(x / width)."""
    return np.tanh(x / width)


def smooth_abs(x: Any, width: float) -> Any:
    """|x| as x tanh(x / width): with a rounded tip, and |x| itself a few widths away from it."""
    return x * np.tanh(x / width)


def log_cosh(x: Any) -> Any:
    """log(cosh(x)) without overflow; its derivative is tanh(x)."""
    y = np.where(np.real(x) < 0, -x, x)
    return y + np.log1p(np.exp(-2.0 * y)) - np.log(2.0)


def beyond_gap(x: Any, below: Any, above: Any = None) -> Any:
    """What is left of x beyond a dead zone from -below to above, corners rounded; exactly x where both are 0.

    Args:
        x: shape (m,).
        below: how far it reaches below zero, shape () or (m,).
        above: how far above; None for as far.
    """
    above = below if above is None else above
    outer, inner = (x + below) / GAP_CORNER, (x - above) / GAP_CORNER
    return x - 0.5 * GAP_CORNER * (log_cosh(outer) - log_cosh(inner)) + 0.5 * (below - above)


def within_gap(x: Any, below: Any, above: Any = None) -> Any:
    """1 within such a dead zone, 0 beyond it, corners rounded."""
    above = below if above is None else above
    return 0.5 * (np.tanh((x + below) / GAP_CORNER) - np.tanh((x - above) / GAP_CORNER))


def loosened(s: JointSignals, *gap: Any) -> Any:
    """What a spring and its damper lose to a dead zone, as `beyond_gap` takes it, shape (m,) [N m]."""
    d = s.deflection
    damper = s.tau_spring - s.stiffness * d
    return s.stiffness * (beyond_gap(d, *gap) - d) - damper * within_gap(d, *gap)


def is_spring_law(effect: Effect) -> TypeGuard[JointTorque]:
    """Whether an effect is a law of the spring of a joint."""
    return isinstance(effect, JointTorque) and effect.side == "spring"
