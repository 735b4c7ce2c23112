# SPDX-License-Identifier: BSD-3-Clause
"""The ticks at which states are estimated: the command stamps, so that the command is constant over every step.

Steps longer than wanted (a slow or interrupted command stream) are divided; the command then acts on. A drive signal
that was measured, as a current beside the positions, runs on between its samples instead: each step gets its mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

LONGEST_STEP = 2.5e-3  # [s] friction changes sign within a few milliseconds
SAME = 2e-6  # [s] nearer times are one: no noise holds two states that are a rounding error apart
SHORTEST_STEP = 2e-5  # [s] below this two commands are one; the later one counts
ALIKE = 1.5  # times its neighbours: a longer interval is a gap, over which no slope beside it tells anything
MOST_TICKS, MOST_PER_SAMPLE = 20_000, 100  # states that no sample tells anything of take memory and time
CUT = "with `ros2 bag convert` (start_time_ns, end_time_ns) or `rosbag filter`"


@dataclass(frozen=True)
class Timeline:
    """Ticks and what acts between them.

    Attributes:
        ticks: times of the states, shape (m + 1,) [s].
        u: command of each step, shape (m, n), SI unit of the command.
    """

    ticks: Array
    u: Array

    @property
    def h(self) -> Array:
        """Length of each step, shape (m,) [s]."""
        return np.diff(self.ticks)

    @staticmethod
    def of(recording: Recording, held: bool = True, between: Array | None = None) -> Timeline:
        """Ticks from the first command to the last sample of any sensor.

        Args:
            recording: with its drive signal.
            held: whether each value of it acts until the next one; otherwise it runs smoothly through its samples.
            between: times at which steps are divided further [s]; those outside, and at ticks, do nothing.

        Raises:
            RecordingError: commands and sensors do not overlap in time.
        """
        command = recording.command
        sensors = [stream for name, stream in recording.streams.items() if name != "command"]
        period = float(np.min(command.periods, initial=np.inf))
        end = min(max(float(s.times[-1]) for s in sensors), float(command.times[-1]) + period)
        keep = np.append(np.diff(command.times) >= SHORTEST_STEP, True) & (command.times < end)
        times, u = command.times[keep], command.values[keep]
        if len(times) < 1 or end - times[0] < 2.0 * SHORTEST_STEP:
            raise RecordingError(
                f"{recording.path}: commands ({command.times[0]:.3f} to {command.times[-1]:.3f} s) and sensors (until "
                f"{end:.3f} s) do not overlap; check that their stamps come from one clock"
            )
        edges = np.append(times, end) if end - times[-1] >= SHORTEST_STEP else times
        u = u[: len(edges) - 1]
        wanted = min(period, LONGEST_STEP)
        parts = np.maximum(np.round(np.diff(edges) / wanted - 0.3), 1).astype(int)
        if parts.sum() > MOST_TICKS + MOST_PER_SAMPLE * recording.sample_count:
            raise RecordingError(
                f"{recording.path}: {recording.sample_count} samples in {end - times[0]:.0f} s are too few to follow a "
                f"motion; expected several in a second: cut out the part in which the robot was recorded, {CUT}"
            )
        fraction = np.concatenate([np.arange(p) / p for p in parts])
        ticks = np.append(np.repeat(edges[:-1], parts) + fraction * np.repeat(np.diff(edges), parts), edges[-1])
        if between is not None:
            inside = between[(between > ticks[0]) & (between < ticks[-1])]
            after = np.searchsorted(ticks, inside)
            far = np.minimum(inside - ticks[after - 1], ticks[after] - inside) > SAME
            ticks = np.union1d(ticks, inside[far])
        # a tick that divides a step may be a rounding error away from its beginning, never beyond its end
        step = np.clip(np.searchsorted(edges, ticks[:-1] + 0.5 * np.diff(ticks)) - 1, 0, len(u) - 1)
        return Timeline(ticks, u[step] if held else _means(command, ticks))

    def locate(self, times: Array) -> tuple[NDArray[np.intp], Array]:
        """Step that holds each time, and the fraction of the step that has passed, shape (k,) each."""
        step = np.clip(np.searchsorted(self.ticks, times, side="right") - 1, 0, len(self.ticks) - 2)
        return step, (times - self.ticks[step]) / self.h[step]

    def locate_ending(self, times: Array) -> tuple[NDArray[np.intp], Array]:
        """As `locate`, but a time at a tick belongs to the step before it, whose command has acted until then."""
        step = np.clip(np.searchsorted(self.ticks, times, side="left") - 1, 0, len(self.ticks) - 2)
        return step, (times - self.ticks[step]) / self.h[step]


def _means(command: Stream, ticks: Array) -> Array:
    """Mean over each step of a signal that runs smoothly through the samples of each channel, shape (m, n).

    Straight lines make (2 pi f h)^2 / 12 too little of what has the frequency f: 0.2 % of 6 Hz at 250 Hz, which torque
    constants then have too much. A cubic through four samples (Catmull, Rom 1974) has an error of the fourth order,
    takes 59 % of a white noise instead of 50 % into a step, and goes astray by 4 % of a jump on each side of it. It is
    a straight line across gaps and at both ends; the last value goes on.
    """
    found = []
    for j in range(command.values.shape[1]):
        own = command.channel(j)
        times = np.append(own.times, max(float(ticks[-1]), float(own.times[-1])) + 1.0)
        values = np.append(own.values[:, 0], own.values[-1:, 0])
        found.append(np.diff(_through(times, values).antiderivative()(ticks)) / np.diff(ticks))
    return np.column_stack(found)


def _through(times: Array, values: Array) -> PPoly:
    """A curve through samples: cubics between equally distant ones, else straight lines."""
    h = np.diff(times)
    straight = np.diff(values) / h
    bend = np.zeros((2, len(h)))  # slopes at both ends of each interval, from its own straight line
    if len(h) > 2:
        slope = np.gradient(values, times)[1:-1]
        longest, shortest = (extreme(np.stack([h[:-2], h[1:-1], h[2:]]), axis=0) for extreme in (np.max, np.min))
        smooth = longest < ALIKE * shortest
        bend[:, 1:-1] = np.where(smooth, np.stack([slope[:-1], slope[1:]]) - straight[1:-1], 0.0)
    first, last = bend
    return PPoly(np.array([(first + last) / h**2, -(2.0 * first + last) / h, straight + first, values[:-1]]), times)
