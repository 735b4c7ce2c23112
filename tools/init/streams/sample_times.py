# SPDX-License-Identifier: BSD-3-Clause
"""Whether the joints of one message were sampled at the stamps of other sensors.

A joint moves smoothly. If its positions lie nearer to the cubics through their neighbours at the stamps of a gyroscope
that has as many messages, the two were sampled together, by the same drive, and the message has the stamp of another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.sensors import BY_MESSAGE
from jointscope.tools.init.streams.sensor_noise import beside_cubics
from jointscope.tools.init.streams.signals import Signal

Array = NDArray[np.float64]

SMOOTHER = 0.9  # times the roughness at the stamps of the message; chance makes less of it
CALM = 0.9  # share of the samples that count, those near gaps are left out
APART = 1e-6  # [s] stamps nearer than this are one


def guess_sample_times(positions: Signal, names: Sequence[str], gyros: Mapping[str, Signal]) -> tuple[str, ...]:
    """For each joint the gyroscope whose stamps are its own, or BY_MESSAGE; empty if all have those of the message.

    Args:
        positions: of the joints.
        names: of the joints in the messages.
        gyros: gyroscopes by name.
    """
    positions, gyros = positions.as_sent, {name: gyro.as_sent for name, gyro in gyros.items()}
    alike = {name: gyro for name, gyro in gyros.items() if len(gyro.times) == len(positions.times)}
    found = tuple(_stamps_of(positions.times, column, alike) for column in positions.columns(tuple(names)).T)
    return found if any(name != BY_MESSAGE for name in found) else ()


def _stamps_of(times: Array, values: Array, gyros: Mapping[str, Signal]) -> str:
    rough = {name: _roughness(gyro.times, values) for name, gyro in gyros.items()}
    best = min(rough, key=lambda name: rough[name], default=BY_MESSAGE)
    return best if best != BY_MESSAGE and rough[best] < SMOOTHER * _roughness(times, values) else BY_MESSAGE


def _roughness(times: Array, values: Array) -> float:
    """Root mean square distance from the cubics through neighbours, without the largest ones."""
    good = np.isfinite(values)
    order = np.flatnonzero(good)[np.argsort(times[good], kind="stable")]
    order = order[np.diff(times[order], prepend=-np.inf) > APART]
    rest = np.sort(beside_cubics(times[order], values[order]))
    return float(np.sqrt(np.mean(rest[: int(CALM * len(rest))]))) if len(rest) else 0.0
