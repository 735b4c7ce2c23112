# SPDX-License-Identifier: BSD-3-Clause
"""HEBI arms: motor against link of every joint, and how late the gyros are."""

from __future__ import annotations

import numpy as np
from real_recordings import MILLI, halves, left, recording, waterfall
from tables import Section, Table

from jointscope.graphs.transmission.discover_links import discover_links
from jointscope.robots.files.robot_file import load_robot

FOLDER = "hebi_arms_mit"
DELAYS = (8e-3, 15e-3)  # [s]
CASES = (
    ("hebi_2r", "arm2_ps2_virtual_spring", 23.0, 1.0, 1 / 2),
    ("hebi_5r", "arm5_capstone_robot_data", 14.0, 2.0, 2 / 3),
)
OTHERS = (
    ("hebi_5r", "arm5_milestone_repeat_waypoints", 2 / 3),
    ("hebi_3r", "arm3_ps5_robot_data", 2 / 3),
    ("hebi_2r", "arm2_ps1_star_trace", 2 / 3),
)


def run() -> Section:
    """Searches in the first part of each recording and scores the rest; then the other way round."""
    section = Section(
        "HEBI arms",
        "`discover` on the first part of a recording, the rest held out. Gear equation: motor encoder - link encoder, "
        "rms without its mean. Both ways: each part predicted by the model of the other part, over the whole "
        "recording, because the motion is not spread evenly over it.",
    )
    delays: list[tuple[str, str, float]] = []
    for robot, bag, rigid, target, share in CASES:
        before, after = _both_ways(robot, bag, share)
        what = f"{bag}, joint1, gear equation, rigid {MILLI * before:.1f} mrad (stated: {rigid:g}), both ways"
        met = MILLI * after <= target
        section.promise(what, f"at most {target:g} mrad", f"{MILLI * after:.2f} mrad", met)
    for robot, bag, *_, share in (*CASES, *OTHERS):
        delays += _one_way(section, robot, bag, share)
    for bag, gyro, delay in delays:
        met = DELAYS[0] <= delay <= DELAYS[1]
        section.promise(f"{bag}, delay of {gyro}", "8 to 15 ms, found as such", f"{MILLI * delay:.1f} ms", met)
    return section


def _one_way(section: Section, robot: str, bag: str, share: float) -> list[tuple[str, str, float]]:
    """The search with its table; delays of gyros that were found."""
    whole = recording(load_robot(robot), f"{FOLDER}/{bag}")
    train, held = halves(whole, share)
    result = discover_links(load_robot(robot), [train], held)
    section.tables.append(waterfall(f"{bag} ({robot}), held-out part, step by step", result))
    rows = []
    for spring in [here for here in result.robot.effects if here.effect.id == "joint_elasticity"]:
        parameter = result.robot.parameters[spring.parameter("compliance")]
        sigma = parameter.sigma or float("nan")
        rows.append((spring.owner, f"{1 / parameter.value:.1f}", f"{sigma / parameter.value**2:.1f}"))
    if rows:
        head = ("joint", "stiffness found [N m/rad]", "sigma")
        section.tables.append(Table(f"{bag}: springs (the device's own calibration: 70, 120 or 130)", head, rows))
    section.numbers[bag] = result.to_json()
    found = [here for here in result.robot.effects if here.effect.id == "gyro_delay"]
    last = result.steps[-1].diagnosis
    missed = [c for c in last.candidates if c.effect == "gyro_delay"] if last is not None else []
    if missed:
        why = "; ".join(f"{c.owner}: {c.reasons[0]}" for c in missed)
        section.notes.append(f"{bag}, no delay found: {why}")
    return [(bag, here.owner, result.robot.parameters[here.parameter("delay")].value) for here in found]


def _both_ways(robot: str, bag: str, share: float) -> tuple[float, float]:
    """Gear equation of joint 1 over the whole recording, base and last model [rad]."""
    first, second = halves(recording(load_robot(robot), f"{FOLDER}/{bag}"), share)
    squares, weights = [], []
    for train, held in ((first, second), (second, first)):
        result = discover_links(load_robot(robot), [train], held)
        squares.append([left(result, "joint1.gear", step) ** 2 for step in (0, -1)])
        weights.append(held.duration)
    before, after = np.sqrt(np.average(squares, axis=0, weights=weights))
    return float(before), float(after)
