# SPDX-License-Identifier: BSD-3-Clause
"""Where a model fails, in plain words: which sensor, how much beside what is allowed, in which motion of which joint.

Axes of one sensor that fail in the same motion and to a like amount share a sentence. Channels near their floor get
none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.comparison.channel_errors import ChannelErrors
from jointscope.graphs.comparison.error_concentration import EVERYWHERE, Concentration, shares
from jointscope.graphs.problem.motion_regimes import AROUND_REVERSAL, NEAR, MotionRegimes
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.parts.sensors import Accelerometer, Gyro, LinkEncoder, MotorEncoder

NEAR_FLOOR = 1.2  # times the floor; a channel below has nothing to say
ALMOST_NONE = 0.25  # of the error; a model that predicts less predicts almost nothing
A_LOT = 0.25  # of what a gyro measures; an error above is told as a part of it
ALIKE = 3.0  # largest ratio of errors over their floors that share a sentence
SAME_MOTION = 0.7  # of a channel's own concentration that it must have in the motion of the channel it joins
STRONG = 0.5  # correlation that is worth telling
COLOURED = 1e-3  # p-value below which errors are called coloured
KINDS: Mapping[type, str] = {
    Gyro: "Gyro",
    Accelerometer: "Accelerometer",
    PositionTarget: "Target",
    MotorEncoder: "The motor encoder of",
    LinkEncoder: "The link encoder of",
    MotorCurrent: "The current of",
}


@dataclass(frozen=True)
class Finding:
    """What is known about one channel.

    Attributes:
        errors: its prediction errors.
        where: the motion in which they are concentrated.
        masks: by regime, when it holds, as in `concentration`.
        correlations: with signals, strongest first.
        whiteness_p: of the test for whiteness.
    """

    errors: ChannelErrors
    where: Concentration
    masks: Mapping[str, NDArray[np.bool_]]
    correlations: Mapping[str, float]
    whiteness_p: float

    @property
    def unpredicted(self) -> bool:
        """Whether the sensor sees something where the model predicts almost nothing."""
        return self.errors.predicted_rms < ALMOST_NONE * self.errors.rms

    def within(self, where: Concentration) -> Concentration:
        """This channel's shares in the motion that another one points at."""
        if not where.regime:
            return EVERYWHERE
        return shares(self.errors.error**2, where.regime, self.masks[where.regime], where.joints)

    def joins(self, first: Finding) -> bool:
        """Whether it can share the sentence of a channel that fails more."""
        mine, theirs = self.errors, first.errors
        return (
            mine.sensor == theirs.sensor
            and bool(self.where.regime) == bool(first.where.regime)
            and self.within(first.where).difference >= SAME_MOTION * self.where.difference
            and self.unpredicted == first.unpredicted
            and max(mine.excess, theirs.excess) <= ALIKE * min(mine.excess, theirs.excess)
        )


def sentences(findings: Sequence[Finding], robot: Robot, regimes: MotionRegimes) -> tuple[str, ...]:
    """One sentence for each group of channels that fail alike.

    Args:
        findings: one per channel, worst first.
        robot: gives the names.
        regimes: gives the thresholds.
    """
    groups: list[list[Finding]] = []
    for finding in findings:
        if finding.errors.excess <= NEAR_FLOOR:
            continue
        home = next((group for group in groups if finding.joins(group[0])), None)
        if home is None:
            groups.append([finding])
        else:
            home.append(finding)
    return tuple(_sentence(group, robot, regimes) for group in groups)


def _sentence(group: Sequence[Finding], robot: Robot, regimes: MotionRegimes) -> str:
    in_order = sorted(group, key=lambda f: robot.channels.index(f.errors.channel))
    parts = [_size(in_order, robot), _when(group, robot, regimes)]
    follows = _follows(group)
    return "; ".join([*parts, follows] if follows else parts) + "."


def _size(group: Sequence[Finding], robot: Robot) -> str:
    """Who sees how much, beside what the model allows."""
    errors = [f.errors for f in group]
    unit = errors[0].unit
    worst = max(errors, key=lambda e: float(np.max(np.abs(e.error))))
    peak = int(np.argmax(np.abs(worst.error)))
    sizes = _listed([f"{e.rms:.2g}" for e in errors])
    highest = f"up to {abs(worst.error[peak]):.2g} at {worst.times[peak]:.2f} s"
    allowed = f"where noise and state uncertainty allow {_listed([f'{e.floor:.2g}' for e in errors])} {unit}"
    sensor = robot.sensors[errors[0].sensor]
    of_axes = isinstance(sensor, Gyro | Accelerometer | PositionTarget)
    labels = _listed([e.channel.rsplit(".", 1)[1] if of_axes else e.channel.rsplit(".", 1)[0] for e in errors])
    way = "about" if isinstance(sensor, Gyro) else "along"
    axes = f" {way} its {labels} {'axes' if len(errors) > 1 else 'axis'}" if of_axes else ""
    name = f"{KINDS[type(sensor)]} {errors[0].sensor if of_axes else labels}"
    if group[0].unpredicted:
        little = max(e.predicted_rms for e in errors)
        return (
            f"{name} sees {sizes} {unit} (rms, {highest}){axes} of which the model predicts almost nothing "
            f"({little:.1g} {unit}), {allowed}"
        )
    parts = [e.rms / float(np.std(e.predicted + e.error)) for e in errors]
    of_it = f" ({_listed([f'{100 * part:.0f}' for part in parts])} % of the motion that it measures there)"
    axes += of_it if of_axes and min(parts) > A_LOT else ""
    return f"{name} differs by {sizes} {unit} (rms, {highest}) from the prediction 0.1 s ahead{axes}, {allowed}"


def _when(group: Sequence[Finding], robot: Robot, regimes: MotionRegimes) -> str:
    """The share of the squared error that falls into the regime, beside that of the time."""
    where = group[0].where
    if not where.regime:
        return "the error is spread over all motion"
    squares = np.array([np.sum(f.errors.error**2) for f in group])
    inside = [f.within(where) for f in group]
    share = float(np.average([c.error_share for c in inside], weights=squares))
    time = float(np.mean([c.time_share for c in inside]))
    return (
        f"{100 * share:.0f} % of the squared error falls into the {100 * time:.0f} % of the time in which "
        f"{_motion(where, robot, regimes)}"
    )


def _motion(where: Concentration, robot: Robot, regimes: MotionRegimes) -> str:
    """A regime of some joints, with the numbers that define it."""
    joints = [robot.joints[j] for j in where.joints]
    if where.regime == "standstill":
        return "no joint moves"
    if where.regime == "reversal":
        return f"{_listed(joints, 'or')} reverses (within {1000 * AROUND_REVERSAL:.0f} ms)"
    if where.regime == "near limits":
        return f"{_listed(joints, 'or')} is within {100 * NEAR:.0f} % of its range from a limit"
    bounds = [regimes.thresholds[where.regime][j] for j in where.joints]
    if where.regime == "fast":
        each = [
            f"{joint} moves faster than {bound:.2g} {robot.unit_at(joint, 'rad/s')}"
            for joint, bound in zip(joints, bounds, strict=True)
        ]
    else:
        bearer = "the spring of {} carries" if regimes.load_unit == "N m" else "{} accelerates by"
        each = [
            f"{bearer.format(joint)} more than {bound:.2g} {robot.unit_at(joint, regimes.load_unit)}"
            for joint, bound in zip(joints, bounds, strict=True)
        ]
    return _listed(each, "or")


def _follows(group: Sequence[Finding]) -> str:
    """The signal that the worst channel follows, commands left out: they follow the error, not the other way."""
    worst = group[0]
    label = f"{worst.errors.channel} " if len(group) > 1 else "it "
    name, r = next(((n, r) for n, r in worst.correlations.items() if not n.endswith(".command")), ("", 0.0))
    if abs(r) >= STRONG:
        joint, signal = name.split(".", 1)
        signal = signal.replace("sign(velocity)", "sign of the velocity")
        return f"{label}follows the predicted {signal} of {joint} (correlation {r:+.2f})"
    if worst.whiteness_p < COLOURED:
        return f"{label}is not white noise (p < {COLOURED:g}), so something systematic is left in it"
    return ""


def _listed(words: Sequence[str], last: str = "and") -> str:
    """The words with commas and a last conjunction."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"
