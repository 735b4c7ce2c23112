# SPDX-License-Identifier: BSD-3-Clause
r"""Whether torques follow their commands after a delay or through a low-pass, by regression of all joints.

    k u(t - d)  or  k w(t) with T w' = u - w     =  M a + c + g + b a + d v + mu sign(v)

To first order both are one; at full size they are not, and values that come with the wrong one of them are wrong. So
commands are moved, or filtered, by the size that leaves least open at all joints, and evidence decides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.regression.evidence import evidence
from jointscope.graphs.scoring.regression.joint_regression import JointRows, fit
from jointscope.graphs.starts.golden_section import golden_section
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.recordings.recording import Stream

Array = NDArray[np.float64]

DELAY, LAG = "command_delay", "motor_lag"
WIDTHS = (0.06, 0.12, 0.24)  # [s] of windows: in wider ones nothing is late
TRIED = tuple(1e-3 * 2.0**k for k in range(7))  # [s]
REFINED = 7  # steps of a golden section
PARTS = 4  # of the time between two commands, in which a low-pass is taken as constant
CLEARLY = 5.0  # by how much the evidence for one must be more than that for the other, as a logarithm


@dataclass(frozen=True)
class LateDrives:
    """How torques follow their commands.

    Attributes:
        effect: id of the one that is more plausible, "command_delay" or "motor_lag".
        size: its delay or time constant [s].
        evidence: for it, over all joints.
        clearly: whether the other one is less plausible by much.
    """

    effect: str
    size: float
    evidence: float
    clearly: bool


def late_drives(rows: JointRows) -> LateDrives | None:
    """What makes torques of all drives late; None where they are not, or the robot's own effects say how.

    Args:
        rows: of the regression.
    """
    robot = rows.robot
    if not robot.command_held or any(h.effect.id in (DELAY, LAG) for h in robot.effects):
        return None
    plain = _left(rows)
    found = {effect: _best(rows, plain, change) for effect, change in ((DELAY, _delayed), (LAG, _filtered))}
    effect = max(found, key=lambda name: found[name][0])
    worth, size = found[effect]
    other = min(worth for worth, _ in found.values())
    return LateDrives(effect, size, worth, worth > other + CLEARLY) if worth > 0.0 else None


def _best(
    rows: JointRows, plain: dict[tuple[int, float], tuple[float, float]], change: Callable[[Stream, float], Stream]
) -> tuple[float, float]:
    """The most evidence, and the size with which commands that are changed by it have that."""

    def worth(size: float) -> float:
        left = _left(rows.with_commands(lambda command: change(command, size)))
        by_joint: dict[int, float] = {}
        for (joint, width), (before, seconds) in plain.items():
            if (joint, width) in left:
                here = evidence(before, left[joint, width][0], seconds, 0)
                by_joint[joint] = max(here, by_joint.get(joint, -np.inf))
        return sum(by_joint.values()) + evidence(1.0, 1.0, max((s for _, s in plain.values()), default=1.0), 1)

    found = [worth(size) for size in TRIED]
    k = int(np.argmax(found))
    refined = golden_section(lambda size: -worth(size), TRIED[k] / 2.0, TRIED[k] * 2.0, REFINED)
    return max([*((-cost, size) for cost, size in refined), (found[k], TRIED[k])])


def _left(rows: JointRows) -> dict[tuple[int, float], tuple[float, float]]:
    """Mean square that is left, and of how much motion it tells [s], by joint and width of windows."""
    found = {}
    for joint in range(rows.robot.n):
        for width in WIDTHS:
            here = rows.of(joint, width)
            if here is not None:
                found[joint, width] = fit(rows.robot, joint, here).left, rows.seconds(width, len(here))
    return found


def _delayed(command: Stream, size: float) -> Stream:
    return replace(command, times=command.times + size)


def _filtered(command: Stream, size: float) -> Stream:
    """Commands behind a low-pass of first order with a time constant [s], as means over parts of their times."""
    effect = catalogue()[LAG]
    assert isinstance(effect, CommandEffect)
    step = np.diff(command.times, append=2.0 * command.times[-1] - command.times[-2])
    times = (command.times[:, None] + step[:, None] * np.arange(PARTS) / PARTS).ravel()
    edges = np.append(times, command.times[-1] + step[-1])
    values = np.repeat(command.values, PARTS, axis=0)
    lagging = [effect.law(edges, column, {"time_constant": size})[0] for column in values.T]
    return replace(command, times=times, values=np.column_stack(lagging), filled=None)
