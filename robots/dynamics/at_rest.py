# SPDX-License-Identifier: BSD-3-Clause
"""A robot that stands: what holds its links and motors, and the band within which dry friction holds a motor.

    links       0 = -g(q) + J^T F - A^T tau_c(delta) + effects
    motors      y = tau_motor(u) + tau_c(delta) + effects,    y + friction = 0,    low <= y <= high

Laws are those of motion at v = 0. The band is what dry friction is just before the motor slips one way or the other:
the same laws at a speed that is nearly nothing, with a friction that turns over at once, so that every law of friction
that depends on load, position or direction says its band by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.known_loads import KnownLoads
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.parts.state_layout import Columns

Array = NDArray[np.float64]
SLIPPING, AT_ONCE = 1e-9, 1e12  # [rad/s] and [s/rad]: their product is far beyond where tanh is one
LOAD_SHARE = "robot.load_scale.share"  # by which known loads are larger than they were said to be
TINY = 1e-6  # step of a difference by it


@dataclass(frozen=True)
class WithSlopes:
    """Torques with derivatives.

    Attributes:
        value: shape (m, k) [N m].
        by_position: by the positions, link before motor, shape (m, k, d).
        by_parameter: by the free parameters, shape (m, k, p).
    """

    value: Array
    by_position: Array
    by_parameter: Array

    def where(self, these: NDArray[np.bool_], others: WithSlopes) -> WithSlopes:
        """`these` of it, shape (m, k), and all else of others."""
        wide = these[:, :, None]
        return WithSlopes(
            np.where(these, self.value, others.value),
            np.where(wide, self.by_position, others.by_position),
            np.where(wide, self.by_parameter, others.by_parameter),
        )


@dataclass(frozen=True)
class AtRest:
    """What holds a robot at m rests.

    Attributes:
        links: torques on link coordinates that no motor turns itself, which vanish in equilibrium, k = number of them.
        motors: y, what friction has to hold, k = n.
        middle, half: of the band of y, k = n.
        sliding: torques on motors that creep, with their whole friction, which vanish, k = n; y where they stand.
    """

    links: WithSlopes
    motors: WithSlopes
    middle: WithSlopes
    half: WithSlopes
    sliding: WithSlopes

    @property
    def held(self) -> WithSlopes:
        """What friction has to hold, less the middle of its band, k = n."""
        return _sum((self.motors, 1.0), (self.middle, -1.0))


def at_rest(
    model: ElasticJoints, positions: Array, u: Array, parameters: Array, loads: KnownLoads, creep: Array | None = None
) -> AtRest:
    """Torques of a standing robot.

    Args:
        model: its equations of motion.
        positions: of links and motors, shape (m, d) [rad].
        u: commands in their SI unit, shape (m, n).
        parameters: values of the free parameters, shape (p,).
        loads: what hangs on it.
        creep: velocities of motors that slide on slowly, shape (m, n) [rad/s], 0 where they stand; none without.
    """
    layout, values = model.layout, model.named(parameters)
    x = np.zeros((len(positions), layout.size))
    x[:, layout.positions] = positions
    q, still = x[:, layout.q_link], np.zeros((len(x), layout.n_link))
    speeds: list[Array | float] = [0.0, SLIPPING, -SLIPPING]
    if creep is not None and np.any(creep):
        speeds.append(creep)
    scale = 1.0 + values.get(LOAD_SHARE, 0.0)
    outside = loads.torque[:, layout.joint_link]
    found = _at_speeds(model, x, u, parameters, scale * outside, speeds)
    if LOAD_SHARE in model.names:
        more = (_at_speeds(model, x, u, parameters, (scale + side * TINY) * outside, speeds) for side in (1.0, -1.0))
        for part, up, down in zip(found, *more, strict=True):
            assert part.by_parameter is not None
            part.by_parameter[:, :, model.names.index(LOAD_SHARE)] += (up.value - down.value) / (2.0 * TINY)
    terms, plain, *sliding = found[0], *(_rows(part, layout.motor_row, layout.positions) for part in found)
    assert terms.by_state is not None and terms.by_parameter is not None
    bodies, n = model.tree.bodies(values), layout.n_link
    terms.value[:, :n] += scale * loads.torque - bodies.torque(q, still, still)
    terms.by_state[:, :n, layout.q_link] += scale * loads.by_q - bodies.gravity_derivatives(q)
    if LOAD_SHARE in model.names:
        terms.by_parameter[:, :n, model.names.index(LOAD_SHARE)] += loads.torque
    for name, weight in model.tree.gravity_by_parameter(q, values).items():
        if name in model.names:
            terms.by_parameter[:, :n, model.names.index(name)] -= weight
    driven = set(layout.motor_row.tolist())
    held = [row for row in range(n) if row not in driven]
    forwards, backwards = sliding[:2]
    # the balance y is held by minus the friction that would act
    middle = _sum((plain, 1.0), (forwards, -0.5), (backwards, -0.5))
    half = _sum((backwards, 0.5), (forwards, -0.5))
    links, motors = (_rows(terms, rows, layout.positions) for rows in (held, layout.motor_row))
    # a rigid joint's motor carries the weight of its links as well
    creeping = _sum((sliding[2], 1.0), (motors, 1.0), (plain, -1.0)) if len(sliding) > 2 else motors
    return AtRest(links, motors, middle, half, creeping)


def _at_speeds(
    model: ElasticJoints, x: Array, u: Array, parameters: Array, outside: Array, speeds: Sequence[Array | float]
) -> list[TorqueTerms]:
    """Torques without the rigid bodies at some speeds of the motors, friction turning over at once; by one call."""
    count, m, layout = len(speeds), len(x), model.layout
    tall = np.tile(x, (count, 1))
    for i, speed in enumerate(speeds):
        tall[i * m : (i + 1) * m, layout.motor_v] = speed
    sharp = np.full(len(layout.joints), AT_ONCE)
    terms = model.torques(tall, np.tile(u, (count, 1)), parameters, np.tile(outside, (count, 1)), sharp)
    assert terms.by_state is not None and terms.by_parameter is not None
    parts = (np.split(part, count) for part in (terms.value, terms.by_state, terms.by_parameter))
    return [TorqueTerms(*part) for part in zip(*parts, strict=True)]


def _rows(terms: TorqueTerms, rows: Columns | list[int], positions: Columns) -> WithSlopes:
    assert terms.by_state is not None and terms.by_parameter is not None
    return WithSlopes(terms.value[:, rows], terms.by_state[:, rows][:, :, positions], terms.by_parameter[:, rows])


def _sum(*parts: tuple[WithSlopes, float]) -> WithSlopes:
    found = (
        np.sum([factor * getattr(part, name) for part, factor in parts], axis=0)
        for name in ("value", "by_position", "by_parameter")
    )
    return WithSlopes(*found)
