# SPDX-License-Identifier: BSD-3-Clause
"""What else would explain the same in these recordings, equation by equation.

Two effects cannot be told apart in one equation if their columns are parallel once everything else that is fitted is
taken out. Lateness of link encoders and viscous friction before a spring are such a pair: both go with the speed.
What separates them is what physics says about several joints: one clock is equally late for all, friction is not, and
friction has a sign.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.transmission.candidates import Candidate, candidates
from jointscope.graphs.transmission.equation import Equation
from jointscope.graphs.transmission.position_ripple import with_order
from jointscope.graphs.transmission.regression import fitted, parts, spread
from jointscope.graphs.transmission.transmission_model import TransmissionModel
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

PARALLEL = 0.95


def look_alikes(
    model: TransmissionModel, recordings: Sequence[Recording], found: Candidate
) -> tuple[tuple[str, ...], str]:
    """Labels of the effects that cannot be told from `found`, and a sentence about what it is."""
    equations = with_order(model.equations(recordings), found)
    labels = []
    for other in candidates(model.robot):
        if other == found or other in model.chosen:
            continue
        if _parallel(equations, model.names, found, other) > PARALLEL:
            labels.append(other.label)
    encoder = model.robot.link_encoder
    if encoder is not None and found.owner == encoder.name:
        return tuple(labels), _lateness_sentence(equations, model, found)
    alike = f"; in these recordings {', '.join(labels)} would explain the same" if labels else ""
    order = f" with {found.order:.4g} periods per turn of the joint" if found.order != 1.0 else ""
    return tuple(labels), f"{found.label} added{order}{alike}."


def per_joint(equations: Sequence[Equation], names: Sequence[str], size: str) -> dict[str, tuple[float, float]]:
    """A shared size found by each joint alone, with its standard deviation, by joint."""
    found = {}
    for gear in sorted({e.name for e in equations if size in e.columns}):
        own = [e for e in equations if e.name == gear]
        columns = [name for name in [*names, size] if any(name in e.columns for e in own)]
        k = columns.index(size)
        found[gear.removesuffix(".gear")] = float(fitted(parts(own, columns))[k]), float(spread(own, columns)[k])
    return found


def _parallel(equations: Sequence[Equation], names: Sequence[str], one: Candidate, other: Candidate) -> float:
    """Smallest share of the other's columns that those of one explain, over the equations that the other is in."""
    shares = []
    for name in sorted({e.name for e in equations}):
        own = [e for e in equations if e.name == name]
        if not any(size in e.columns for e in own for size in other.sizes):
            continue
        left = np.vstack([p.columns for p in parts(own, [*names, *one.sizes, *other.sizes])])
        base, first, second = np.split(left, [len(names), len(names) + len(one.sizes)], axis=1)
        first, second = _without(first, base), _without(second, base)
        size = np.linalg.norm(second)
        shares.append(1.0 - float(np.linalg.norm(_without(second, first)) / size) ** 2 if size > 0.0 else 0.0)
    return float(np.sqrt(min(shares, default=0.0)))


def _without(columns: Array, base: Array) -> Array:
    """Columns without their parts along a base."""
    used = base[:, np.linalg.norm(base, axis=0) > 0.0]
    if not used.shape[1]:
        return columns
    used = used / np.linalg.norm(used, axis=0)
    return columns - used @ np.linalg.lstsq(used, columns, rcond=1e-9)[0]


def _lateness_sentence(equations: Sequence[Equation], model: TransmissionModel, found: Candidate) -> str:
    """One lateness for all joints, or friction: what the joints say one by one."""
    by_joint = per_joint(equations, model.names, found.sizes[0])
    said = ", ".join(f"{joint} {1e3 * late:.2f} +- {1e3 * sigma:.2f} ms" for joint, (late, sigma) in by_joint.items())
    late = np.array([value for value, _ in by_joint.values()])
    sentence = (
        f"{found.owner} is late against the motor encoders: {said}, joint by joint. A part that goes with the speed "
        "looks like viscous friction or damping before the spring, too, and the two cannot be told apart in one joint"
    )
    if np.all(late > 0.0) and len(late) > 1 and np.ptp(late) < 0.25 * np.mean(late):
        return (
            f"{sentence}; one time for all joints, and a sign that friction would not have (it holds the motor back), "
            "say that it is time."
        )
    return f"{sentence}; here the joints do not agree on one time, so damping remains possible."
