# SPDX-License-Identifier: BSD-3-Clause
"""How late measured currents are, and where their constants begin, before anything is calibrated.

The command tells between which two of its stamps a current was read, the gap; within that gap only a speed changes, and
speeds that are differences of positions are too coarse for it: a controller feeds the errors of its positions back into
the command. So the gap is found here, and the place in it by the states of a calibration
(calibration/current_delay.py). Where the command itself is late, it is later than the speed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.screening.drive_currents import EARLIEST, LATEST, DriveCurrents
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.command_words import robot_argument
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.motor_current import MotorCurrent
from jointscope.robots.recordings.recording import Notice, Recording

Array = NDArray[np.float64]

FITS = 0.3  # of a channel's standard deviation that its drive may leave
SURE = 25.0  # chi-square by which another delay must be better
PER_STEP = 4  # delays that are tried in a step
HALVINGS = 12  # to the ends of a gap
MOVED = 0.01  # of the samples that see another command beyond them
APART = 0.75  # steps between the middles of the gaps of two recordings, beyond which they share no delay
LATE_COMMAND = 1.5  # steps by which a command must be later than the speeds


@dataclass(frozen=True)
class CurrentGap:
    """Delays that see the same commands, of currents [s].

    Attributes:
        first, last: its ends.
        command: by how much later commands act than the robot's effects say; 0 where nothing says so.
    """

    first: float
    last: float
    command: float = 0.0

    @property
    def middle(self) -> float:
        """Between both ends."""
        return (self.first + self.last) / 2.0

    def __str__(self) -> str:
        """As "1 to 2 ms"."""
        first, last = (round(1e3 * end, 2) + 0.0 for end in (self.first, self.last))  # + 0.0: no "-0"
        return f"{first:g} to {last:g} ms"

    @property
    def start(self) -> float:
        """No delay where that is among them, else the middle."""
        return 0.0 if self.first <= 0.0 < self.last else self.middle

    @property
    def sigma(self) -> float:
        """Standard deviation of a delay that may be anywhere in it."""
        return (self.last - self.first) / float(np.sqrt(12.0))


def with_current_delay(robot: Robot, recordings: Sequence[Recording]) -> tuple[Robot, list[Notice]]:
    """The robot with a delay of its currents in the right gap, and a sentence where its file or a command was late.

    Args:
        robot: the model.
        recordings: of it.

    Raises:
        RecordingError: one delay cannot be that of all recordings.
    """
    sensor = robot.motor_current
    if sensor is None or not sensor.estimate_delay or not recordings:
        return robot, []
    _check_same(robot, sensor, recordings)
    gap = current_gap(robot, recordings)
    if gap is None:
        return robot, []
    said, late = list[Notice](), gap.start
    if gap.first <= sensor.delay < gap.last:
        late = sensor.delay
    elif late != sensor.delay:
        text = (
            f"{sensor.name}: currents fit their drives with a delay of {gap}, "
            f"the file says {1e3 * sensor.delay:.3g} ms; `estimate_delay: false` in sensors.{sensor.name} keeps it"
        )
        said.append(Notice(sensor.name, "info", 0, text))
    if gap.command:
        label = f"command_delay@robot -o {robot.name}_late.yaml"
        text = (
            f"{sensor.name}: in the currents, commands act about {1e3 * gap.command:.2g} ms later than the speeds of "
            f"the motors say; `jointscope add {robot_argument(robot)} {label}` estimates it"
        )
        said.append(Notice(sensor.name, "info", 0, text))
    return robot.with_sensors({sensor.name: replace(sensor, delay=late, delay_sigma=gap.sigma)}), said


def _check_same(robot: Robot, sensor: MotorCurrent, recordings: Sequence[Recording]) -> None:
    """Recordings share one delay: gaps between other commands do not have one."""
    if len(recordings) < 2:
        return
    gaps = [(gap, r) for r in recordings if (gap := current_gap(robot, [r])) is not None]
    if not gaps:
        return
    early, late = (which(gaps, key=lambda each: each[0].middle) for which in (min, max))
    step = float(np.median(np.diff(late[1].command.times)))
    if late[0].middle - early[0].middle > APART * step:
        said = " and ".join(f"{g} in {r.path}" for g, r in (early, late))
        raise RecordingError(
            f"{sensor.name}: currents are late by {said}, and one delay has to serve all of them; calibrate them one "
            f"by one, or write `estimate_delay: false` in sensors.{sensor.name}, which keeps that of the file"
        )


def current_gap(robot: Robot, recordings: Sequence[Recording]) -> CurrentGap | None:
    """Between which stamps of commands the currents of a robot were read; None where recordings do not tell."""
    parts = [part for recording in recordings if (part := DriveCurrents.of(recording, robot)) is not None]
    if not parts:
        return None
    h = float(np.median([part.h for part in parts]))
    tried = tried_delays(h)
    costs = _Costs(parts)
    lefts = np.array([costs.left(late, late) for late in tried])
    at = least_left(lefts)
    best = float(tried[at])
    if costs.share(best) > FITS or at in (0, len(tried) - 1):
        return None
    seen, command = best, 0.0
    if parts[0].by_volts:
        apart = np.array([costs.left(best, late) for late in tried])
        speeds = float(tried[least_left(apart)])
        free = any(isinstance(here.effect, CommandEffect) for here in robot.effects)
        gained = len(parts[0].times) * float(np.sum(np.log(costs.left(best, best) / costs.left(best, speeds))))
        if gained > SURE and (free or best - speeds > LATE_COMMAND * h):
            seen, command = speeds, 0.0 if free else best - speeds
    gap = CurrentGap(*costs.gap(seen, h), command)
    return gap if len(parts[0].times) * np.sum(np.log(costs.worst(gap, h) / costs.left(best, best))) > SURE else None


def tried_delays(step: float) -> Array:
    """Delays that are looked at, a few in each step of the commands; shape (k,) [s]."""
    first, last = (round(end / step * PER_STEP) for end in (EARLIEST, LATEST))
    return np.asarray(step / PER_STEP * np.arange(first, last + 1), dtype=np.float64)


def with_current_constants(start: Calibration, robot: Robot, recordings: Sequence[Recording]) -> Calibration:
    """Start values with constants of the currents that go with those of the drives; as they are where nothing tells.

    Args:
        start: values to begin with.
        robot: with the delay of its currents.
        recordings: of it.
    """
    sensor = robot.motor_current
    parts = [] if sensor is None else [DriveCurrents.of(recording, robot) for recording in recordings]
    if sensor is None or not all(parts):
        return start
    known = robot.values | start.by_name
    dynamics = start.dynamics.copy()
    for j, joint in enumerate(robot.joints):
        fits = [part.fit(j, j, sensor.delay, sensor.delay) for part in parts if part is not None]
        by_command = float(np.median([fit.by_command for fit in fits]))
        by_speed = float(np.median([fit.by_speed for fit in fits]))
        gain = 1.0 if robot.drive_gain is None else known[robot.drive_parameter(joint, robot.drive_gain).name]
        constant, back_emf, _ = sensor.of_joint(joint)
        found = {constant: robot.command_volts * gain / by_command, back_emf: -by_speed}
        if max(fit.share for fit in fits) < FITS:
            for name in (name for name, value in found.items() if name in start.names and value > 0.0):
                dynamics[start.names.index(name)] = np.log(found[name])
    return start.with_points({DYNAMICS: dynamics})


def least_left(lefts: Array) -> int:
    """Which of k trials leaves the least of all n channels together, shape (k, n)."""
    return int(np.argmin(np.sum(np.log(np.maximum(lefts, 1e-300)), axis=1)))


@dataclass(frozen=True)
class _Costs:
    """What drives leave of their own currents, over all recordings, by two delays."""

    parts: Sequence[DriveCurrents]
    known: dict[tuple[float, float], Array] = field(default_factory=dict)

    def share(self, late: float) -> float:
        """Largest share of a channel that is left."""
        return max(part.fit(j, j, late, late).share for part in self.parts for j in range(part.n))

    def left(self, by_u: float, by_v: float) -> Array:
        """Sums of squares that are left of each channel, shape (n,) [A^2]."""
        if (by_u, by_v) not in self.known:
            found = [[part.fit(j, j, by_u, by_v).left for j in range(part.n)] for part in self.parts]
            self.known[by_u, by_v] = np.maximum(np.sum(found, axis=0), 1e-300)
        return self.known[by_u, by_v]

    def worst(self, gap: CurrentGap, h: float) -> Array:
        """What the better neighbour of a gap leaves."""
        return min((self.left(late, late) for late in (gap.first - h / 2.0, gap.last + h / 2.0)), key=np.sum)

    def gap(self, late: float, h: float) -> tuple[float, float]:
        """First and last delay that sees the same commands as one does, up to a few samples [s]."""
        here = [part.steps(late) for part in self.parts]

        def same(other: float) -> bool:
            moved = [np.mean(part.steps(other) != steps) for part, steps in zip(self.parts, here, strict=True)]
            return float(np.mean(moved)) < MOVED

        return _end(same, late, late - h), _end(same, late, late + h)


def _end(same: Callable[[float], bool], inside: float, outside: float) -> float:
    """The last place on the way outside that is still inside."""
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2.0
        inside, outside = (middle, outside) if same(middle) else (inside, middle)
    return inside
