# SPDX-License-Identifier: BSD-3-Clause
"""Lines of a robot file about the accelerometer of an IMU: written as comments, since a calibration goes without it.

Who takes "# " away uses it. What an IMU without one sends, zeros, is said.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.robots.parts.sensors import AXES
from jointscope.robots.units import si_factor
from jointscope.tools.init.robot_guess import GuessedGyro
from jointscope.tools.init.streams.sensor_noise import guess_noise
from jointscope.tools.init.streams.signals import Signal
from jointscope.tools.init.text.source_text import sigma_line, source_lines

GRAVITY = 9.81  # [m/s^2]
SAME = 1.5  # a size within this factor of gravity's is gravity with what is left of motion upon it
WINDOW, QUIETEST = 0.1, 0.05  # [s], [1] of the windows: those in which the readings change least are nearest to rest
UNITS = ("m/s^2", "g")


def accelerometer_lines(gyro: GuessedGyro, gravity: Sequence[float]) -> list[str]:
    """Comment lines; none where messages do not hold accelerations, `gravity` is that of the robot."""
    signal = gyro.acceleration
    if signal is None:
        return []
    size = _size_at_rest(signal)
    if not np.any(signal.values):
        return [f"  # no accelerometer on {signal.topic}: linear_acceleration is zero"]
    unit = next((u for u in UNITS if 1.0 / SAME < size * si_factor(u) / GRAVITY < SAME), None)
    if unit is None:
        return [f"  # not used: {signal.topic}, linear_acceleration of size {size:.3g}: no unit makes that gravity"]
    name = f"{gyro.name}_acceleration"
    section = [
        f"  {name}:",
        "    kind: accelerometer",
        f"    gyro: {gyro.name}",
        *source_lines(signal, unit),
        *(["    left_handed: true"] if gyro.mount.left_handed else []),
        *([] if any(gravity) else ["    gravity: [0.0, 0.0, -9.81]"]),
        sigma_line(guess_noise(signal.times, signal.values, unit), unit),
        "    bias: {value: [0.0, 0.0, 0.0], prior_sigma: 0.5}",
    ]
    places = [f"  {name}.lever_{axis}: {{value: 0.0, unit: m, positive: false, prior_sigma: 0.1}}" for axis in AXES]
    bare = [text.split("  #")[0].rstrip() for text in section]  # what is guessed in a comment is no guess yet
    return [
        f"  # {signal.topic} has an accelerometer, too, which feels gravity in {unit}; to use it, take '# ' away:",
        *(f"  # {text[2:]}" for text in bare),
        "  # and write where it sits on its link under parameters:",
        *(f"  # {text[2:]}" for text in places),
    ]


def _size_at_rest(signal: Signal) -> float:
    """Size of the mean reading in the quietest windows, in the unit of the signal: fast motion adds to its median."""
    window = np.floor((signal.times - signal.times[0]) / WINDOW).astype(int)
    edges = np.flatnonzero(np.diff(window, prepend=-1))
    counts = np.diff(np.append(edges, len(window)))[:, None]
    means = np.add.reduceat(signal.values, edges) / counts
    spread = np.add.reduceat(signal.values**2, edges) / counts - means**2
    full = np.flatnonzero(counts[:, 0] >= np.median(counts) / 2.0)
    quiet = full[np.argsort(spread[full].sum(axis=1))[: max(int(QUIETEST * len(full)), 1)]]
    return float(np.median(np.linalg.norm(means[quiet], axis=1)))
