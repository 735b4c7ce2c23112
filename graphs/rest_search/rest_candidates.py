# SPDX-License-Identifier: BSD-3-Clause
"""Rests that an arm might have: postures on a grid, weights, where motors and springs would stand, and what that tells.

The model that was found says where the robot stands. A friction band of half width s says of the torque that it holds
what a variance of s^2 / 3 does. Of s itself n rests tell s / n if its edges are sharp, and one more would add
(2 n + 1) / s^2 to the information; since edges are not known to be, n / s^2 counts, with n = s / sigma(s).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.robots.dynamics.transmission import motor_angles
from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.rests.rests import Rests

Array = NDArray[np.float64]

POSTURES, LEVELS, LOADS = 500, 5, 3  # at the most, on the grid; levels of each joint; weights, none included
STEP = np.radians(5.0)  # of angles that are advised
WIDER = 0.25  # of the range that was seen, that it may be left by at both ends where a joint has no limits
WIDEST = 4.0 * np.pi  # [rad or m] between limits that are any
REACHED = 1.1  # times the largest command and deflection of the rests
NEWTON, SETTLED = 30, 1e-6  # steps to equilibrium, and what may be left of the torques
CHUNK = 250  # candidates at once


def candidate_rows(
    problem: RestSet,
    calibration: Calibration,
    known: Array,
    seen: Array,
    q: Array,
    forces: Array,
    links: tuple[str, ...],
) -> Array:
    """Whitened rows of rests at some postures by the shared values, states eliminated, shape (c, k, p).

    Rows are zero where the robot cannot stand so, or with larger commands or deflections than it had.

    Args:
        problem: rests with the weights that others would have, too.
        calibration: values.
        known: covariance of their coordinates, shape (p, p).
        seen: states of the rests, shape (m, d), that say how far springs may deflect; empty to let them.
        q: joints, shape (c, n) [rad].
        forces: loads, shape (c, 3) [N].
        links: that they hang on.
    """
    found = []
    for a in range(0, len(q), CHUNK):
        part = slice(a, a + CHUNK)
        rests = _rests_at(problem.rests, q[part], forces[part], links[part])
        standing = _scales_of(replace(problem, rests=rests))
        x, u, possible = _standing(standing, calibration, problem.rests, seen)
        standing = replace(standing, rests=replace(rests, u=u, q_motor=x[:, standing.places(_motors(problem))]))
        J, P = _rows(standing, calibration, known, x)
        own = np.swapaxes(J, 1, 2) @ J
        left = P - J @ np.linalg.solve(own, np.swapaxes(J, 1, 2) @ P)
        found.append(left * possible[:, None, None])
    return np.concatenate(found)


def _rows(problem: RestSet, calibration: Calibration, known: Array, x: Array) -> tuple[Array, Array]:
    """Derivatives of whitened rows by states, shape (c, k, d), and by values, shape (c, k, p)."""
    torques = problem.torques(x, calibration)
    _, J, P = problem.equations(x, torques, calibration)
    bands = problem.bands(x, torques, calibration)
    (y_J, y_P), (_, half_P) = bands.y_slopes, bands.half_slopes
    w_y = 1.0 / np.sqrt(bands.half**2 / 3.0 + bands.sigma**2)[:, :, None]
    spread = np.sqrt(np.maximum(np.einsum("cnp,pq,cnq->cn", half_P, known, half_P), 1e-12 * bands.half**2))
    w_half = 1.0 / np.sqrt(bands.half * spread)[:, :, None]
    rows_J, rows_P = [J, w_y * y_J, 0.0 * y_J], [P, w_y * y_P, w_half * half_P]
    return np.hstack(rows_J), np.hstack(rows_P)


def _motors(problem: RestSet) -> NDArray[np.intp]:
    return problem.robot.layout.motor_q


def _scales_of(problem: RestSet) -> RestSet:
    """With scales of torques for any number of rests."""
    torque, friction = (np.median(np.atleast_2d(s), axis=0) for s in (problem.torque_scale, problem.friction_scale))
    return replace(problem, torque_scale=torque, friction_scale=friction)


def _rests_at(like: Rests, q: Array, forces: Array, links: tuple[str, ...]) -> Rests:
    """Rests whose readings are as steady as others were; motors and commands follow."""
    c = len(q)
    motor, link, u = (
        np.broadcast_to(np.median(each, axis=0), q.shape)
        for each in (like.motor_scatter, like.link_scatter, like.u_scatter)
    )
    return replace(
        like, times=np.zeros((c, 2)), q_motor=q.copy(), q_link=None if like.q_link is None else q.copy(),
        u=np.zeros_like(q), motor_scatter=motor, link_scatter=link, u_scatter=u, forces=forces, links=links,
        moved=np.ones(q.shape, dtype=bool), creep=np.zeros_like(q), rounding=None,
        turning_points=None,
    )  # fmt: skip


def _standing(problem: RestSet, calibration: Calibration, had: Rests, seen: Array) -> tuple[Array, Array, Array]:
    """Positions in equilibrium, shape (c, d), commands whose friction holds nothing, (c, n), and whether it can be."""
    robot, layout = problem.robot, problem.robot.layout
    q = problem.rests.q_motor
    x = np.zeros((len(q), layout.size))
    x[:, layout.motor_q], x[:, layout.joint_q] = motor_angles(robot, q), q
    x = x[:, layout.positions]
    joints = problem.places(layout.joint_q)
    inner = [k for k in range(x.shape[1]) if k not in joints]
    scale = problem.torque_scale[problem.held]
    for _ in range(NEWTON if inner else 0):
        links = problem.torques(x, calibration).links
        slopes = links.by_position[:, :, inner]
        x[:, inner] -= (np.linalg.pinv(slopes) @ links.value[:, :, None])[:, :, 0]
        if np.all(np.abs(links.value) < SETTLED * scale):
            break
    found = problem.torques(x, calibration)
    gain = problem.model.drive_gain(calibration.values)
    u = -found.held.value / gain
    strongest = _strongest(problem, gain, had)
    possible = np.all(np.isfinite(u), axis=1) & np.all(np.abs(u) <= strongest, axis=1)
    if inner:
        possible &= np.all(np.abs(found.links.value) < 1e3 * SETTLED * scale, axis=1)
    if len(seen) and inner:
        motors = problem.places(layout.motor_q)
        bent = {here.owner for here in robot.effects if isinstance(here.effect, JointTorque) and _is_bent(here.effect)}
        some = np.array([joint in bent for joint in robot.joints])
        far = np.abs(motor_angles(robot, seen[:, joints]) - seen[:, motors]).max(axis=0)
        within = np.abs(motor_angles(robot, x[:, joints]) - x[:, motors]) <= REACHED * far
        possible &= np.all(within | ~some, axis=1)
    return x, u, possible


def _is_bent(effect: JointTorque) -> bool:
    """Whether a law makes a spring no straight line."""
    return effect.side == "spring" and effect.memory is None


def _strongest(problem: RestSet, gain: Array, had: Rests) -> Array:
    """Largest command of each motor, shape (n,)."""
    efforts = problem.robot.tree.effort_limits
    seen = REACHED * np.abs(had.u).max(axis=0)
    told = (efforts > 0.0) & np.isfinite(efforts) & (problem.robot.transmission is None)  # those are of joints
    return np.where(told, efforts / np.abs(gain), seen)


def postures(problem: RestSet, seen: Array) -> Array:
    """Postures on a grid within the limits of the joints, or where the arm has rested, shape (c, n)."""
    robot = problem.robot
    lower, upper = seen.min(axis=0), seen.max(axis=0)
    wider, limits = WIDER * (upper - lower), robot.tree.limits
    told = np.isfinite(limits).all(axis=1) & (limits[:, 1] - limits[:, 0] < WIDEST)
    lower = np.where(told, limits[:, 0], lower - wider)
    upper = np.where(told, limits[:, 1], upper + wider)
    levels = [
        np.unique([rounded(value, joint in robot.tree.slides) for value in np.linspace(a, b, LEVELS)])
        for joint, a, b in zip(robot.joints, lower, upper, strict=True)
    ]
    count = int(np.prod([len(each) for each in levels]))
    if count <= POSTURES:
        return np.array(list(product(*levels)))
    rng = np.random.default_rng(0)
    return np.column_stack([rng.choice(each, POSTURES) for each in levels])


def rounded(value: float, slides: bool) -> float:
    """An angle that a person can set; what slides stays as it is."""
    return float(value) if slides else float(np.round(value / STEP) * STEP)


def loads_tried(rests: Rests) -> list[tuple[str, Array]]:
    """No weight, and some of those that hung on the arm, the largest first."""
    each = {(link, tuple(np.round(force, 3))): force for link, force in zip(rests.links, rests.forces, strict=True)}
    hung = [(link, force) for (link, _), force in each.items() if link and np.any(force)]
    hung.sort(key=lambda pair: -float(np.linalg.norm(pair[1])))
    some = list(_spread(hung, LOADS - 1))
    return [("", np.zeros(3)), *some]


def _spread(hung: list[tuple[str, Array]], count: int) -> Iterator[tuple[str, Array]]:
    """Some of a sorted list, the first and the last of them included."""
    for k in np.unique(np.linspace(0, len(hung) - 1, min(count, len(hung))).astype(int)) if hung else ():
        yield hung[int(k)]
