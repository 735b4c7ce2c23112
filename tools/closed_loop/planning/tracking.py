# SPDX-License-Identifier: BSD-3-Clause
"""How well a run kept to its plan: errors of links and head, what came after the hits, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.tools.closed_loop.planning.plan import Hit, Plan

Array = NDArray[np.float64]

SETTLED = 0.02  # of the stroke of the head


@dataclass(frozen=True)
class HitError:
    """One hit as it was.

    Attributes:
        position: distance of the head from its place at the planned time [m].
        velocity: size of the error of its velocity then [m/s].
        overshoot: largest way of a joint past its home, after the planned arrival [rad].
        settling: from the planned arrival until the head stays within 2 % of its stroke; None if it never does [s].
    """

    position: float
    velocity: float
    overshoot: float
    settling: float | None


@dataclass(frozen=True)
class Tracking:
    """Errors of one run against its plan, and against what the controller believed.

    Attributes:
        link_position, link_velocity: root mean squares over time, shape (n_joints,) [rad], [rad/s].
        motor_position: root mean squares of the motors' errors, as joint angles, shape (n_joints,) [rad].
        head_position, head_velocity: root mean squares of the sizes of the head's errors [m], [m/s].
        hits: in the order of the plan.
        effort: root mean square of the command as a share of the full one.
        chatter: root mean square change of the command from tick to tick, as a share of the full one.
        saturated: share of the ticks at which any command was at its limit.
        estimation: root mean square of known - true for "q_link", "v_link", "q_motor", "v_motor", over all joints
            [rad], [rad/s].
    """

    link_position: Array
    link_velocity: Array
    motor_position: Array
    head_position: float
    head_velocity: float
    hits: tuple[HitError, ...]
    effort: float
    chatter: float
    saturated: float
    estimation: dict[str, float]

    @property
    def link_position_rms(self) -> float:
        """Over all joints [rad]."""
        return _rms(self.link_position)

    @property
    def e_rms(self) -> float:
        """Sum over links and motors of their root mean squares, eq. (58) of Ho and Kisner, with 1/N [rad]."""
        return float(np.sum(self.link_position) + np.sum(self.motor_position))

    @property
    def link_velocity_rms(self) -> float:
        """Over all joints [rad/s]."""
        return _rms(self.link_velocity)

    @property
    def hit_position(self) -> float:
        """Root mean square over the hits [m]."""
        return _rms([hit.position for hit in self.hits])

    @property
    def hit_velocity(self) -> float:
        """Root mean square over the hits [m/s]."""
        return _rms([hit.velocity for hit in self.hits])

    @property
    def overshoot(self) -> float:
        """Largest of all hits [rad]."""
        return max(hit.overshoot for hit in self.hits)

    @property
    def settling(self) -> float | None:
        """Median over the hits; None if most never settle [s]."""
        median = float(np.median([np.inf if hit.settling is None else hit.settling for hit in self.hits]))
        return median if np.isfinite(median) else None


def tracking(
    plan: Plan,
    planned_head: Array,
    motor_error: Array,
    states: Array,
    head: Array,
    estimates: Array,
    commands: Array,
    full: Array,
) -> Tracking:
    """Measures a run.

    Args:
        plan: what the links should have done.
        planned_head: where the head should have been, shape (m, 3) [m].
        motor_error: of the motors' angles against those that hold the plan's postures, as joint angles,
            shape (m, n_joints) [rad].
        states: true (q_link, v_link, q_motor, v_motor), shape (m, 4 n_joints).
        head: where the head was, shape (m, 3) [m].
        estimates: the same as `states`, as the controller knew them.
        commands: issued, shape (m, n_joints).
        full: the full commands, shape (n_joints,).
    """
    n, step = plan.q.shape[1], float(plan.times[1] - plan.times[0])
    q, v = states[:, :n], states[:, n : 2 * n]
    head_error = head - planned_head
    head_rate_error = np.gradient(head_error, step, axis=0)
    share = commands / full
    sizes = np.linalg.norm(head_error, axis=1), np.linalg.norm(head_rate_error, axis=1)
    names = ("q_link", "v_link", "q_motor", "v_motor")
    known = {name: _rms((estimates - states)[:, k * n : (k + 1) * n]) for k, name in enumerate(names)}
    return Tracking(
        np.sqrt(np.mean((q - plan.q) ** 2, axis=0)),
        np.sqrt(np.mean((v - plan.v) ** 2, axis=0)),
        np.sqrt(np.mean(motor_error**2, axis=0)),
        _rms(sizes[0]),
        _rms(sizes[1]),
        tuple(_hit_error(plan, hit, planned_head, q, head, *sizes) for hit in plan.hits),
        _rms(share),
        _rms(np.diff(share, axis=0)),
        float(np.mean(np.any(np.abs(share) >= 1.0 - 1e-9, axis=1))),
        known,
    )


def _hit_error(
    plan: Plan, hit: Hit, planned_head: Array, q: Array, head: Array, distance: Array, rate: Array
) -> HitError:
    at, back, end = (plan.tick(time) for time in (hit.time, hit.back, hit.end))
    side = np.sign(hit.q - plan.home)
    overshoot = float(np.max(-side * (q[back : end + 1] - plan.home), initial=0.0))
    begin = plan.tick(hit.start)
    stroke = float(np.max(np.linalg.norm(planned_head[begin:back] - planned_head[begin], axis=1)))
    away = np.flatnonzero(np.linalg.norm(head[back : end + 1] - planned_head[back], axis=1) > SETTLED * stroke)
    settling: float | None = 0.0
    if len(away):
        settling = None if away[-1] == end - back else float(plan.times[back + away[-1] + 1] - hit.back)
    return HitError(float(distance[at]), float(rate[at]), overshoot, settling)


def _rms(values: Array | list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
