# SPDX-License-Identifier: BSD-3-Clause
"""Moments at which an encoder on a link jumps: the link slipped on what carries it, or the encoder lost its zero.

    excess of a step: d_k - slope of its neighbours      jump: by how much lines through the samples beside it differ

A blow changes a velocity and a glitch comes back; a jump is in one step and stays. It is an event, no effect: no model
of the robot before and behind it has it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Notice, Recording, Stream

Array = NDArray[np.float64]

JUMP = "jump"  # kind of its notices
BESIDE = 8  # samples on either side through which lines go
NEIGHBOURS = 3.0  # median periods, beyond which two samples are no neighbours
USUAL = 0.995  # of the excesses are smaller than what jitter, steps of a counter and motion make
CLEAR = 8.0  # times the usual excess
STAYS = (0.7, 1.4)  # share of the step's excess by which the lines differ
MOST = 3  # in one channel: what jumps more often is no event


@dataclass(frozen=True)
class EncoderJump:
    """One jump.

    Attributes:
        channel: whose reading jumps.
        time: middle of the step [s].
        size: by how much the reading is larger behind it [rad, m].
    """

    channel: str
    time: float
    size: float


def encoder_jumps(stream: Stream) -> list[EncoderJump]:
    """Jumps of all channels, in the order of time."""
    found = []
    for k in range(len(stream.channels)):
        own = _jumps_of(stream.channel(k))
        found += own if len(own) <= MOST else []
    return sorted(found, key=lambda jump: jump.time)


def jump_notices(recording: Recording, robot: Robot) -> list[Notice]:
    """A sentence for each jump of an encoder on a link, but for those that were left out."""
    encoder = robot.link_encoder
    if encoder is None:
        return []
    stream = recording.streams[encoder.name]
    first, last = float(stream.times[0]), float(stream.times[-1])
    notices = []
    for jump in encoder_jumps(stream):
        if any(t0 <= jump.time <= t1 for t0, t1 in recording.left_out):
            continue
        before = jump.time - first < last - jump.time  # the shorter part
        part = f"{first:.2f}:{jump.time + 0.01:.2f}" if before else f"{jump.time - 0.01:.2f}:{last + 0.01:.2f}"
        text = (
            f"{jump.channel} jumps by {jump.size:+.3g} {stream.unit} at {jump.time:.3f} s and stays there: a link that "
            "slipped on its plates or an encoder that lost its zero, an event and no effect; motion before and behind "
            f"it belongs to two robots: leave one part out with --leave-out {recording.path}:{part}"
        )
        notices.append(Notice(encoder.name, JUMP, 1, text))
    return notices


def _jumps_of(one: Stream) -> list[EncoderJump]:
    """Jumps of a stream with a single channel."""
    t, r = one.times, one.values[:, 0]
    steps, dt = np.diff(r), np.diff(t)
    if len(steps) < 4 * BESIDE:
        return []
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps / dt, BESIDE, mode="edge"), 2 * BESIDE + 1)
    excess = steps - np.median(windows, axis=1) * dt
    usual = float(np.quantile(np.abs(excess), USUAL))
    near = dt < NEIGHBOURS * float(np.median(dt))
    inside = np.arange(len(steps))
    clear = near & (np.abs(excess) > CLEAR * usual) & (inside >= BESIDE) & (inside < len(steps) - BESIDE)
    found = []
    for k in np.flatnonzero(clear):
        at = 0.5 * float(t[k] + t[k + 1])
        size = _line_at(t, r, slice(k + 1, k + 1 + BESIDE), at) - _line_at(t, r, slice(k + 1 - BESIDE, k + 1), at)
        if STAYS[0] < size / excess[k] < STAYS[1]:
            found.append(EncoderJump(one.channels[0], at, float(size)))
    return found


def _line_at(t: Array, r: Array, samples: slice, at: float) -> float:
    """Value at a time of the line through some samples."""
    return float(np.polyfit(t[samples] - at, r[samples], 1)[1])
