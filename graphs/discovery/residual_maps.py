# SPDX-License-Identifier: BSD-3-Clause
"""The missing torque against what may cause it: velocity, position, deflection and load of every joint.

A map is the median with its quartiles in bins of one signal. How telling it is: the share of the torque's variance
between the bins, minus the share that the same signal reaches when it is shifted in time (smooth torques follow any
smooth signal a little).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.discovery.missing_torque import MissingTorque

Array = NDArray[np.float64]

BINS = 32
FEWEST = 12  # samples in a bin
TAILS = 0.005  # share of the samples on each side that the bins leave out
MOST_SAMPLES = 20_000  # more do not change the medians
SHIFTS = (0.17, 0.29, 0.43, 0.61, 0.78)  # of the recording


@dataclass(frozen=True)
class ResidualMap:
    """One torque against one signal.

    Attributes:
        row: equation, as in MissingTorque.rows ("joint1.link").
        signal: "joint1.velocity", "joint1.position", "joint1.deflection" or "joint1.load".
        unit: of the signal.
        centers: of the bins that hold enough samples, shape (k,) [unit].
        low, median, high: quartiles of the torque, shape (k,) each [N m].
        explained: median of what a candidate explains, by label, shape (k,) each [N m].
        torque_unit: of the torque, a force at a prismatic joint.
        telling: share of the variance between the bins beyond that of shifted signals, -1 to 1.
    """

    row: str
    signal: str
    unit: str
    centers: Array
    low: Array
    median: Array
    high: Array
    explained: Mapping[str, Array]
    telling: float
    torque_unit: str = "N m"

    @property
    def own(self) -> bool:
        """Whether equation and signal belong to the same joint."""
        return self.row.split(".")[0] == self.signal.split(".")[0]


def residual_maps(missing: MissingTorque) -> list[ResidualMap]:
    """All maps of all equations, the most telling first."""
    stride = max(1, -(-len(missing.times) // MOST_SAMPLES))
    maps = []
    for i, row in enumerate(missing.rows):
        torque = missing.torque[::stride, i]
        explained = {label: curve[::stride, i] for label, curve in missing.explained_by.items() if np.any(curve[:, i])}
        for name, unit, values in _signals(missing, row.rsplit(".", 1)[-1]):
            found = _map(missing.unit(row, "N m"), row, name, unit, values[::stride], torque, explained)
            if found is not None:
                maps.append(found)
    return sorted(maps, key=lambda m: -m.telling)


def _signals(missing: MissingTorque, side: str) -> list[tuple[str, str, Array]]:
    """Name, unit and values of what a torque on one side of the springs may depend on."""
    q, v = (missing.q_motor, missing.v_motor) if side == "motor" else (missing.q_link, missing.v_link)
    kinds = (
        ("velocity", "rad/s", v),
        ("position", "rad", q),
        ("deflection", "rad", missing.q_link - missing.q_motor),
        ("load", "N m", missing.tau_spring),
    )
    return [
        (f"{joint}.{name}", missing.unit(joint, unit), x[:, j])
        for j, joint in enumerate(missing.joints)
        for name, unit, x in kinds
    ]


def _map(
    torque_unit: str, row: str, name: str, unit: str, signal: Array, torque: Array, explained: Mapping[str, Array]
) -> ResidualMap | None:
    edges = _edges(signal)
    if edges is None:
        return None
    place = np.digitize(signal, edges) - 1
    bins = [k for k in range(len(edges) - 1) if np.count_nonzero(place == k) >= FEWEST]
    if len(bins) < 3:
        return None
    low, median, high = np.array([np.quantile(torque[place == k], (0.25, 0.5, 0.75)) for k in bins]).T
    curves = {label: np.array([np.median(y[place == k]) for k in bins]) for label, y in explained.items()}
    centers = 0.5 * (edges[1:] + edges[:-1])[bins]
    by_chance = max(_between(np.roll(place, round(s * len(place))), torque, len(edges) - 1) for s in SHIFTS)
    telling = _between(place, torque, len(edges) - 1) - by_chance
    return ResidualMap(row, name, unit, centers, low, median, high, curves, telling, torque_unit)


def _edges(signal: Array) -> Array | None:
    """Bins of equal width between the tails; None for a signal that does not move."""
    if len(signal) < 3 * FEWEST or not np.all(np.isfinite(signal)):
        return None
    low, high = np.quantile(signal, (TAILS, 1.0 - TAILS))
    return np.linspace(low, high, BINS + 1) if high - low > 1e-9 else None


def _between(place: NDArray[np.intp], torque: Array, count: int) -> float:
    """Share of the variance between bins; samples outside of the bins do not count."""
    inside = (place >= 0) & (place < count)
    place, torque = place[inside], torque[inside]
    total = float(np.var(torque)) * len(torque)
    if total <= 0.0:
        return 0.0
    number = np.bincount(place, minlength=count)
    mean = np.bincount(place, torque, minlength=count) / np.maximum(number, 1)
    return float(np.sum(number * (mean - np.mean(torque)) ** 2)) / total
