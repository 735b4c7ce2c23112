# SPDX-License-Identifier: BSD-3-Clause
"""Motion and command as exact means over short, equal cells of time.

A mean acceleration is the difference of two velocities, a mean velocity that of two positions, and the mean of a
command that is held from its stamp to the next follows from the stamps alone. So command and motion pass one and the
same filter, however they were sampled: half a sample of delay between them costs percents at 50 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Stream, unknown_commands

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CELLS_PER_SAMPLE = 4  # of the encoders; the command changes between their samples
FEWEST_SAMPLES = 10  # a curve through fewer says nothing of accelerations
SHORTEST_CELL = 1.5e-3  # [s] motion is smooth within it
SHORTEST_SPAN = 0.1  # [s] hardly anything moves in less
MOST_CELLS = 40_000
GAP = 4.5  # [sample periods] between two samples from which nobody knows what happened there
MEMORY = 0.03  # [s] over which accelerations are alike
UNCLEAR = 3.0  # [sigma] of a velocity below which its sign is not known
AT_REST = 0.01  # of the rms velocity
REVERSAL = 1.6  # times as long as a joint turns over at its rms acceleration: who is slower sticks, below the limit


@dataclass(frozen=True)
class MotionCells:
    """Means over m cells of n joints.

    Attributes:
        h: length of a cell [s].
        times: middles, shape (m,) [s].
        q: positions at the middles, shape (m, n) [rad].
        v: mean velocities, shape (m, n) [rad/s].
        v_smooth: velocities at the edges without most of the noise, shape (m + 1, n) [rad/s].
        a: mean accelerations, shape (m, n) [rad/s^2].
        u: mean commands, shape (m, n).
        known: cells in which friction has the size of sliding, and no sample is missing, shape (m, n).
        periods: of the samples of each encoder, shape (n,) [s].
    """

    h: float
    times: Array
    q: Array
    v: Array
    v_smooth: Array
    a: Array
    u: Array
    known: Flags
    periods: Array

    @property
    def edges(self) -> Array:
        """Edges of the cells, shape (m + 1,) [s]."""
        return np.append(self.times - 0.5 * self.h, self.times[-1] + 0.5 * self.h)


def motion_cells(
    encoder: Stream,
    command: Stream,
    sigmas: Array,
    held: bool = True,
    left_out: Sequence[tuple[float, float]] = (),
) -> MotionCells:
    """Cells where both streams are.

    Args:
        encoder: positions, zero at zero [rad].
        command: what drives the joints.
        sigmas: noise of the encoders, shape (n,) [rad].
        held: whether a command acts until the next one; else it was measured and is linear between samples.
        left_out: stretches of time in which something else acted [s].

    Raises:
        RecordingError: the two do not overlap, or hardly, or there are hardly any positions.
    """
    fewest = int(np.min(np.count_nonzero(np.isfinite(encoder.measured), axis=0), initial=len(encoder)))
    if fewest < FEWEST_SAMPLES:
        raise RecordingError(f"there are {fewest} positions; expected at least {FEWEST_SAMPLES}")
    periods = encoder.periods
    period = float(np.min(periods))  # of the fastest node, where several publish
    t0 = float(max(encoder.times[0], command.times[0]))
    t1 = float(min(encoder.times[-1], command.times[-1] + (period if held else 0.0)))
    if t1 - t0 < period:
        raise RecordingError(
            f"positions ({encoder.times[0]:.3f} to {encoder.times[-1]:.3f} s) and commands ({command.times[0]:.3f} to "
            f"{command.times[-1]:.3f} s) do not overlap; check that their stamps come from one clock"
        )
    if t1 - t0 < SHORTEST_SPAN:
        raise RecordingError(
            f"positions and commands share only {t1 - t0:.3g} s, with a position every {period:.3g} s; expected at "
            f"least {SHORTEST_SPAN:g} s: record longer, or check the unit of the stamps"
        )
    h = max(period / CELLS_PER_SAMPLE, SHORTEST_CELL, (t1 - t0) / MOST_CELLS)
    edges: Array = t0 + h * np.arange(max(int((t1 - t0) / h), 0) + 1, dtype=np.float64)
    (q, v), middle = _path(encoder, edges), 0.5 * (edges[1:] + edges[:-1])
    v_smooth, v_sigma = _smooth(v, sigmas, periods, h)
    means = mean_commands(command, edges, held)
    slow = np.maximum(UNCLEAR * v_sigma, AT_REST * np.sqrt(np.mean(v_smooth**2, axis=0)))
    resting = np.abs(v_smooth) < slow
    rush = np.sqrt(np.mean(np.gradient(v_smooth, h, axis=0) ** 2, axis=0)) if len(edges) > 2 else np.ones(len(slow))
    fewest = np.maximum(REVERSAL * 2.0 * slow / np.maximum(rush, 1e-12), 2.0 * h) / h
    measured = np.isfinite(encoder.measured)  # one joint's motion moves the others, too
    missing = [_missing(encoder.times[good], middle, own) for good, own in zip(measured.T, periods, strict=True)]
    usable = ~np.any(missing, axis=0)
    unknown = [stretch for stretches in unknown_commands(command).values() for stretch in stretches] if held else []
    for begin, end in [*left_out, *unknown]:
        usable &= (middle < begin - h) | (middle > end + h)
    known = ~_dwelling(resting[1:] & resting[:-1], fewest) & usable[:, None]
    at_middle, a = _path(encoder, middle)[0], np.diff(v, axis=0) / h
    return MotionCells(h, middle, at_middle, np.diff(q, axis=0) / h, v_smooth, a, means, known, periods)


def on_links(cells: MotionCells, links: Stream, sigmas: Array) -> MotionCells:
    """The same cells with the motion that encoders on the links saw; sigmas of those, shape (n,) [rad]."""
    edges, periods = cells.edges, links.periods
    q, v = _path(links, edges)
    missing = [
        _missing(links.times[good], cells.times, own)
        for good, own in zip(np.isfinite(links.measured).T, periods, strict=True)
    ]
    return replace(
        cells,
        q=_path(links, cells.times)[0],
        v=np.diff(q, axis=0) / cells.h,
        v_smooth=_smooth(v, sigmas, periods, cells.h)[0],
        a=np.diff(v, axis=0) / cells.h,
        known=cells.known & ~np.any(missing, axis=0)[:, None],
        periods=periods,
    )


def mean_commands(command: Stream, edges: Array, held: bool) -> Array:
    """Mean of the commands between edges, shape (m, n), for edges of shape (m + 1,) [s]."""
    return np.asarray(np.diff(_integral(command, edges, held), axis=0) / np.diff(edges)[:, None])


def _path(encoder: Stream, times: Array) -> tuple[Array, Array]:
    """Positions and velocities on curves through the samples of each joint, shape (m, n); at rest outside of them."""
    found = []
    for j in range(encoder.values.shape[1]):
        own = encoder.channel(j)
        inside = (times >= own.times[0]) & (times <= own.times[-1])
        curve, at = CubicSpline(own.times, own.values[:, 0]), np.clip(times, own.times[0], own.times[-1])
        found.append((curve(at), np.where(inside, curve(at, 1), 0.0)))
    return np.column_stack([q for q, _ in found]), np.column_stack([v for _, v in found])


def _integral(command: Stream, edges: Array, held: bool) -> Array:
    """Integral of the commands to the edges, shape (m, n), each joint's from its own stamps."""
    found = []
    for j in range(command.values.shape[1]):
        own = command.channel(j)
        times, values, steps = own.times, own.values[:, 0], np.diff(own.times)
        parts = steps * (values[:-1] if held else 0.5 * (values[:-1] + values[1:]))
        total = np.append(0.0, np.cumsum(parts))
        i = np.clip(np.searchsorted(times, edges, side="right") - 1, 0, len(times) - 1)
        since = edges - times[i]
        slope = np.zeros(len(times))
        if not held:
            slope[:-1] = np.diff(values) / steps
        found.append(total[i] + since * (values[i] + 0.5 * since * slope[i]))
    return np.column_stack(found)


def _smooth(v: Array, sigmas: Array, periods: Array, h: float) -> tuple[Array, Array]:
    """Velocities smoothed as far as their noise asks for, and the noise that is left, shape (n,).

    Where accelerations are white with density S, the best smoother of positions with noise sigma at every period is
    1 / (1 + (omega / omega_c)^4) with omega_c^4 = S / (sigma^2 period), the gain of a Butterworth filter of second
    order there and back.
    """
    out, left = v.copy(), np.zeros(v.shape[1])
    for j, (sigma, period) in enumerate(zip(sigmas, periods, strict=True)):
        if sigma <= 0.0 or len(v) < 20:
            continue
        whole = np.concatenate([2.0 * v[0, j] - v[:0:-1, j], v[:, j], 2.0 * v[-1, j] - v[-2::-1, j]])
        spectrum, frequency = np.fft.rfft(whole), 2.0 * np.pi * np.fft.rfftfreq(len(whole), h)
        density = 2.0 * MEMORY * float(np.mean(np.gradient(v[:, j], h) ** 2))
        for _ in range(3):  # the noise is in the first guess of the accelerations, too
            omega = float(np.clip((density / (sigma**2 * period)) ** 0.25, 2.0, 0.45 * 2.0 * np.pi / h))
            smooth = np.fft.irfft(spectrum / (1.0 + (frequency / omega) ** 4), len(whole))
            out[:, j] = smooth[len(v) - 1 : 2 * len(v) - 1]
            density = 2.0 * MEMORY * float(np.mean(np.gradient(out[:, j], h) ** 2))
        left[j] = sigma * np.sqrt(period * omega**3 / (8.0 * np.sqrt(2.0)))
    return out, left


def _dwelling(slow: Flags, fewest: Array) -> Flags:
    """Cells in runs of at least so many slow ones, shape (m, n); `fewest` of each joint, shape (n,)."""
    found = np.zeros_like(slow)
    for j in range(slow.shape[1]):
        change = np.flatnonzero(np.diff(np.concatenate([[False], slow[:, j], [False]]).astype(np.int8)))
        for start, stop in change.reshape(-1, 2):
            found[start:stop, j] = stop - start >= fewest[j]
    return found


def _missing(times: Array, instants: Array, period: float) -> Flags:
    """Instants in gaps between samples that usually come so often [s], or farther outside of them, shape (m,)."""
    steps = np.diff(times)
    i = np.clip(np.searchsorted(times, instants) - 1, 0, len(steps) - 1)
    outside = (instants < times[0] - period) | (instants > times[-1] + period)
    return np.asarray(outside | (steps[i] > GAP * period))
