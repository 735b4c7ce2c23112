# SPDX-License-Identifier: BSD-3-Clause
"""Ball hitting, the task of Doggy: the head meets a ball at a place, with a velocity, at a time, and comes home.

Places and directions are drawn at random. Each hit is as fast as the model says that the drives can do with a reserve
for the feedback, inside the joints' limits of angle and velocity.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.tools.closed_loop.planning.passage import Passage
from jointscope.tools.closed_loop.planning.plan import Hit, Plan
from jointscope.tools.closed_loop.planning.reference import model_reference
from jointscope.tools.simulator.loop.controller import full_command
from jointscope.tools.simulator.loop.motion import joint_span

Array = NDArray[np.float64]

REST = 0.5  # [s] before the first hit
STAY = 0.5  # [s] at home after each
REACH = (0.35, 0.8)  # of the amplitude of each joint, from the middle of its range
SPEED = (0.35, 0.6)  # of the joints' velocity limits at the hit
COMMAND_SHARE = 0.7  # of the full command that the plan may use; the rest is for the feedback
TRIES = 10  # places before a robot is said to be too weak
SHORTEST, LONGER, LONGEST = 0.15, 1.1, 2.0  # [s], factor between trials, [s]: from home to the hit
RETURN = 1.3  # time of the way home over that of the way out
STEP = 2e-3  # [s] of a trial
NUDGE = 1e-6  # [rad] of the central difference


def hitting_plan(robot: Robot, times: Array, home: Array, rng: np.random.Generator) -> Plan:
    """As many hits as there is time for.

    Args:
        robot: the model: its limits, drives and bodies.
        times: of the ticks, shape (m,) [s].
        home: where the joints rest, shape (n_joints,) [rad].
        rng: draws places and directions.

    Returns:
        The plan; the joints stay home when no further hit fits.

    Raises:
        SimulationError: not even one hit fits.
    """
    q = np.tile(home, (len(times), 1))
    v, a = np.zeros_like(q), np.zeros_like(q)
    end, t, hits = float(times[-1]), REST, list[Hit]()
    while True:
        there, back = _strike(robot, home, rng)
        hit_time, home_time = t + there.duration, t + there.duration + back.duration
        if home_time + STAY > end + 1e-9:
            break
        for passage, begin in ((there, t), (back, hit_time)):
            now = (times >= begin) & (times <= begin + passage.duration)
            q[now], v[now], a[now] = (passage.at(times[now] - begin, order) for order in range(3))
        at_hit = (there.at(np.array([there.duration]), order)[0] for order in (0, 1))
        hits.append(Hit(t, hit_time, home_time, home_time + STAY, *at_hit))
        t = home_time + STAY
    if not hits:
        needed = REST + there.duration + back.duration + STAY
        raise SimulationError(f"seconds: one hit takes {needed:.1f} s, got {end:.1f}; give more")
    return Plan(times, q, v, a, home, tuple(hits))


def speed_limits(robot: Robot) -> Array:
    """Largest velocity of each joint, shape (n_joints,) [rad/s]: of the URDF, and of the motor running free."""
    limits = robot.tree.velocity_limits
    if "k_mi" not in robot.drive_laws:
        return np.where(np.isfinite(limits), limits, 2.0 * np.pi)
    volts = full_command(robot) * robot.command_volts
    for i, joint in enumerate(robot.joints):
        back_emf = robot.drive_parameter(joint, "k_mi").value
        if back_emf > 0:
            limits[i] = min(limits[i], robot.drive_parameter(joint, "k_pwm").value * volts[i] / back_emf)
    return np.where(np.isfinite(limits), limits, 2.0 * np.pi)


def _strike(robot: Robot, home: Array, rng: np.random.Generator) -> tuple[Passage, Passage]:
    """The way to a random hit and the way home, as fast as the drives can; places out of their reach are drawn anew."""
    centre, amplitude = joint_span(robot)
    for _ in range(TRIES):
        side = rng.choice([-1.0, 1.0], robot.n)
        q = centre + side * rng.uniform(*REACH, robot.n) * amplitude
        v = _velocity(robot, q, rng) * rng.uniform(*SPEED)
        duration = SHORTEST if _can_hold(robot, q) else LONGEST
        while duration < LONGEST:
            there = Passage(home, 0.0 * v, q, v, duration)
            back = Passage(q, v, home, 0.0 * v, RETURN * duration)
            if _possible(robot, there, back):
                return there, back
            duration *= LONGER
    raise SimulationError(
        f"robot {robot.name!r}: no hit is possible within {LONGEST:g} s at {100 * COMMAND_SHARE:g} % of the full "
        "command; check the limits, the drives and the inertias of the robot file"
    )


def _velocity(robot: Robot, q: Array, rng: np.random.Generator) -> Array:
    """Joint velocities that move the head in a random direction, one of them at its limit, shape (n_joints,)."""
    J = head_jacobian(robot, q)
    direction, size, _ = np.linalg.svd(J)
    possible = direction[:, : len(size)][:, size > 1e-6]
    if not possible.shape[1]:
        v = rng.standard_normal(robot.n)  # a head on the axes moves nowhere: then let the joints be fast
    else:
        v = np.linalg.pinv(J, rcond=1e-6) @ possible @ rng.standard_normal(possible.shape[1])
    return v / np.max(np.abs(v) / speed_limits(robot))


def head_jacobian(robot: Robot, q: Array) -> Array:
    """Derivative of the head's position by the joints, shape (3, n_joints) [m/rad], at angles of shape (n_joints,)."""
    nudges = NUDGE * np.eye(robot.n)
    plus, minus = (robot.tree.body_poses(robot.tree.bodies[-1], q + sign * nudges)[1] for sign in (1.0, -1.0))
    return (plus - minus).T / (2.0 * NUDGE)


def _can_hold(robot: Robot, q: Array) -> bool:
    """Whether the drives can hold the robot at angles of shape (n_joints,) against its weight."""
    still, times = np.tile(q, (3, 1)), np.array([0.0, STEP, 2.0 * STEP])
    u = model_reference(robot, times, still, 0.0 * still, 0.0 * still).u
    return bool(np.all(np.abs(u) <= COMMAND_SHARE * full_command(robot)))


def _possible(robot: Robot, there: Passage, back: Passage) -> bool:
    """Whether the model can do it within all limits."""
    times = np.arange(0.0, there.duration + back.duration + STAY, STEP)
    first = times <= there.duration
    q, v, a = (
        np.vstack([there.at(times[first], order), back.at(times[~first] - there.duration, order)]) for order in range(3)
    )
    low, high = robot.tree.limits.T
    if np.any(q < low) or np.any(q > high) or np.any(np.abs(v) > speed_limits(robot)):
        return False
    u = model_reference(robot, times, q, v, a).u
    return bool(np.all(np.abs(u) <= COMMAND_SHARE * full_command(robot)))
