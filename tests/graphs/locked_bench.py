# SPDX-License-Identifier: BSD-3-Clause
"""Benches with locked springs, by the lengths of their ropes: links move, and ropes that do not stretch turn motors.

BioRob: radii of Table 1; the rope of joint 4 runs over an idler on the axis of joint 3. A Doggy whose joints 2 and 3
hang on a differential: both motors turn both links, so no element of that block is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import LinkEncoder
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

LATE = 0.004  # [s] of the links' encoders
BIOROB = load_robot("biorob")
_doggy = load_robot("doggy")
_link_topic = replace(_doggy.motor_encoder.source, topic="/link_states")
DOGGY = replace(
    _doggy,
    sensors={
        "motor_encoder": _doggy.motor_encoder,
        "link_encoder": LinkEncoder("link_encoder", _link_topic, np.full(3, 2e-4), np.zeros(3), _doggy.joints),
    },
)
BIOROB_T = {(0, 0): 79 / 245, (1, 1): 121 / 403, (2, 2): 121 / 306, (3, 2): -121 / 306 * 12 / 25, (3, 3): 0.36}
"""Link angle per motor angle of the radii, by hand: joint 4 goes back by the idler's share of joint 3's turn."""
DOGGY_T = {(0, 0): 2.0, (1, 1): 0.45, (1, 2): 0.45, (2, 1): 0.625, (2, 2): -0.625}
"""Half the sum and half the difference of the motors, over the wheels' radii."""


def biorob_ropes(q: Array) -> Array:
    """Angles of the motors' pulleys, shape (m, 4): what each rope runs off its joint and its idler, over the radius."""
    off = q * [0.0245, 0.0403, 0.0306, 0.0250]
    off[:, 3] += q[:, 2] * 0.0120
    return np.asarray(off / [0.0079, 0.0121, 0.0121, 0.0090])


def doggy_ropes(q: Array) -> Array:
    """Motors of a belt and of a differential, shape (m, 3)."""
    common, apart = q[:, 1] / 0.9, q[:, 2] * 0.8
    return np.stack([0.5 * q[:, 0], common + apart, common - apart], axis=1)


def with_matrix(robot: Robot, elements: dict[tuple[int, int], float]) -> Robot:
    """A robot whose file has these elements, and no others."""
    T = np.zeros((robot.n, robot.n))
    for at, value in elements.items():
        T[at] = value
    return replace(robot, transmission=T)


def locked_bench(
    robot: Robot,
    seed: int,
    seconds: float = 20.0,
    late: float = LATE,
    give: float = 0.0,
    path: str = "bench",
    ropes: Callable[[Array], Array] | None = None,
) -> Recording:
    """A recording of slow motion.

    Args:
        robot: BIOROB or DOGGY, for its topics, steps of encoders and, where clamps give way, weight.
        seed: of motion, zeros of the motors, and noise.
        seconds: that it lasts.
        late: by which the links' encoders answer [s].
        give: of the ropes, in the motors' coordinates [rad/(N m)].
        path: of the bag.
        ropes: motors of links, where they are others than those of the robot.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 0.01)
    waves = rng.uniform(0.15, 0.4, (3, robot.n)), rng.uniform(0.03, 0.3, (3, robot.n)), rng.uniform(0, 6, (3, robot.n))

    def links(times: Array) -> Array:
        return np.asarray(sum(a * np.sin(2 * np.pi * f * times[:, None] + p) for a, f, p in zip(*waves, strict=True)))

    q = links(t)
    ropes = ropes or (biorob_ropes if robot.n == 4 else doggy_ropes)
    motors = ropes(q)
    if give:
        weight = robot.tree.torque(q, 0.0 * q, 0.0 * q)
        motors = motors + give * (weight @ np.linalg.inv(ropes(np.eye(robot.n))).T)
    motors = motors + rng.uniform(-1.0, 1.0, robot.n)
    steps = np.sqrt(12.0) * robot.motor_encoder.sigmas, np.sqrt(12.0) * robot.link_encoder.sigmas
    readings = {
        "motor_encoder": (t, np.round(motors / steps[0]) * steps[0]),
        "link_encoder": (t + 0.003, np.round(links(t + 0.003 - late) / steps[1]) * steps[1]),
        "command": (t, 0.2 * np.sin(t)[:, None] * np.ones(robot.n)),
    }
    suffix = {"motor_encoder": "motor_position", "link_encoder": "link_position", "command": "command"}
    unit = {"command": robot.command.unit if robot.command.unit != "duty" else "1"}
    streams = {
        name: Stream(name, at, values, tuple(f"{j}.{suffix[name]}" for j in robot.joints), unit.get(name, "rad"))
        for name, (at, values) in readings.items()
    }
    return Recording(path, f"{path}{seed}", 10**18, streams)
