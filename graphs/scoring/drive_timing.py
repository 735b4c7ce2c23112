# SPDX-License-Identifier: BSD-3-Clause
r"""Whether the drive signal and the sensors were stamped at the same time: a score test after every calibration.

A torque that acts a time d after its stamp looks like friction and springs that are not there,

    tau(t - d) = tau(t) - d tau'(t),        tau' holds M a' = -M omega^2 v for a motion with frequency omega,

and process noise takes what is left, so no residual tells. One linear step with a delay does: how long it would be, and
by how much it would change the values. Nothing is estimated anew. An encoder that is read later than those of the other
joints does the same to its joint alone, and is asked for, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.hypothesis_score import HypothesisStep
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

EFFECT, OWNER = "command_delay", "robot"
ENCODER = "encoder_delay"
USUAL = 0.8  # of the sigmas of a late drive signal of one joint, with which a late encoder of another is named
CLEARER = 1.5  # times the sigmas of a late drive that one late encoder must have, to be named instead
EARLY_OR_LATE = 5.0  # [sigma] from which a delay of the drive signal is one ...
FILTERED = 1e-3  # [s] of a delay after the stamps, from which filters are late by as much
MOVES = (3.5, 0.01)  # [sigma of a value, share of it], both, from which it matters


@dataclass(frozen=True)
class DriveTiming:
    """What one step with a delay of the drive signal says.

    Attributes:
        delay: of the torque after its stamp; below zero where the signal was late [s].
        sigma: its standard deviation, from blocks of the recording where these scatter more [s].
        changes: what the delay would add to each parameter, in the parameter's unit.
        joint: whose encoder is late against those of the others, or whose drive signal is where `delay` is below zero;
            empty where it is the drive signal of all.
    """

    delay: float
    sigma: float
    changes: dict[str, float]
    joint: str = ""

    @property
    def what(self) -> str:
        """Which stamps are not those of the others, in words."""
        if self.joint:
            late = f"encoder of {self.joint} seems to be read"
            return late if self.delay > 0.0 else f"drive signal of {self.joint} seems to act"
        return "drive signal seems to act"

    def cure(self, robot: Robot, effect: str = EFFECT) -> str:
        """What to do about it, in words.

        Args:
            robot: of a file.
            effect: id of what makes the drive signal late.
        """
        if self.joint:
            return f"correct its stamps where they are made, or record {self.joint} with the others' clock and filter"
        output = edited_argument(robot, effect)
        alike = ""
        if self.delay > FILTERED and effect == EFFECT:
            alike = " (a low-pass of the positions, encoder_filter, or of the drive, motor_lag, is late, too)"
        elif self.delay < -FILTERED and robot.command_held and not robot.layout.motors:
            alike = (
                ", if its stamps are late: no command acts before it is sent. A motor whose link hangs on a spring or "
                "in a gap moves early, too, where the file calls the joint rigid (joint_elasticity, backlash)"
            )
        return f"`jointscope add {robot_argument(robot)} {effect}@{OWNER} -o {output}`, then calibrate again{alike}"

    def moved(self, found: Mapping[str, Value]) -> list[str]:
        """Names of the values that the delay would change by much; none where it may be chance.

        Args:
            found: calibrated values with their sigmas, by name.
        """
        if abs(self.delay) < EARLY_OR_LATE * self.sigma:
            return []
        (sigmas, share), values = MOVES, [n for n in found if n in self.changes and not n.endswith(".delay")]
        changes = {n: abs(self.changes[n]) for n in values}
        return [n for n, d in changes.items() if d > sigmas * found[n].sigma and d > share * abs(found[n].value)]


def drive_timing(test: ScoreTest) -> DriveTiming | None:
    """The delay that a solved calibration asks for; None where the model has times of its own, or no commands.

    Args:
        test: of the whole recordings, linearised at their solution with the noise used.
    """
    robot = test.robot
    if robot.choices.link_dynamics != "model" or _has(robot, TimeShift):
        return None
    asked = [] if _has_late_commands(robot) else [(EFFECT, OWNER)]
    if robot.n > 1 and robot.link_encoder is None and not robot.gyros:
        asked += [(ENCODER, joint) for joint in robot.joints]
    if not asked:
        return None
    here = [EffectAt(catalogue()[effect], owner) for effect, owner in asked]
    hypotheses = [EffectHypothesis(at, at.effect.parameters_at(robot, at.owner)) for at in here]
    found = [_timing(test, step) for step in test.steps(hypotheses)]
    drive = next((timing for timing in found if timing is not None and not timing.joint), None)
    encoders = [timing for timing in found if timing is not None and timing.joint]
    # of two that say nearly the same, a late encoder is the usual one
    late = max(encoders, key=lambda e: _clearness(e) / (USUAL if e.delay > 0.0 else 1.0), default=None)
    if drive is None or (late is not None and _clearness(late) > CLEARER * _clearness(drive)):
        return late or drive
    return drive


def _timing(test: ScoreTest, step: HypothesisStep) -> DriveTiming | None:
    """What one step says; None where it tells nothing."""
    delay, sigma = float(step.sizes[0]), float(step.sigmas[0])
    if not np.isfinite(delay) or not np.isfinite(sigma):
        return None
    start, owner = test.calibration, step.hypothesis.here.owner
    before = start.by_name
    changes = {name: value - before[name] for name, value in test.values_with(step).items()}
    return DriveTiming(delay, sigma, changes, "" if owner == OWNER else owner)


def _clearness(timing: DriveTiming) -> float:
    """By how many sigmas it differs from none."""
    return abs(timing.delay) / timing.sigma if timing.sigma > 0.0 else 0.0


def _has_late_commands(robot: Robot) -> bool:
    """Whether an effect moves commands in time; what only changes their size leaves the question open."""
    commands = [here for here in robot.effects if isinstance(here.effect, CommandEffect)]
    return any(p.unit == "s" for here in commands for p in here.effect.parameters)


def _has(robot: Robot, kind: type) -> bool:
    return any(isinstance(here.effect, kind) for here in robot.effects)
