# SPDX-License-Identifier: BSD-3-Clause
"""Which rest to add, as a sentence that a person at the bench can follow: degrees and kilograms."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.rest_search.next_rest import NextRest
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.relative_sigma import relative_sigma
from jointscope.tools.presentation.numbers import significant

ALONG = 0.999  # cosine of the angle to gravity, from which a force is a weight


def next_rest_sentence(rest: NextRest, robot: Robot) -> str:
    """For example "gravity.beta2 (+-18 %): add a rest with joint1 at 30 deg, ...: +-6 % after one, +-2 % after ten"."""
    matter = [_at(joint, rest.posture[joint], robot) for joint in rest.matters]
    others = [_at(joint, q, robot, "") for joint, q in rest.posture.items() if joint not in rest.matters]
    where = f"with {', '.join(matter)}" if matter else "where the arm usually rests"
    if others:
        where += f" ({', '.join(others)})"
    after = f"{relative_sigma(rest.after)} after one, about {relative_sigma(rest.after_ten)} after ten"
    return f"{rest.name} ({relative_sigma(rest.share)}): add a rest {where}, {_load(rest, robot)}: {after}"


def _at(joint: str, q: float, robot: Robot, word: str = "at ") -> str:
    if joint in robot.tree.slides:
        return f"{joint} {word}{significant(q, 3)} m"
    return f"{joint} {word}{round(float(np.degrees(q)))} deg"


def _load(rest: NextRest, robot: Robot) -> str:
    if not rest.link:
        return "without a weight"
    size, g = float(np.linalg.norm(rest.force)), robot.tree.gravity
    strength = float(np.linalg.norm(g))
    if strength > 0.0 and rest.force @ g > ALONG * size * strength:
        return f"{significant(size / strength, 3)} kg on {rest.link}"
    x, y, z = (significant(float(f), 3) for f in rest.force)
    return f"pulled by ({x}, {y}, {z}) N at {rest.link}"
