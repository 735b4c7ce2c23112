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

from jointscope.graphs.transmission.candidates import Hypothesis
from jointscope.graphs.transmission.linear_equations import LinearEquations, solved_products

PARALLEL = 0.95
ONE_TIME = 0.25  # relative difference of joints that may still share one lateness


def look_alikes(
    equations: LinearEquations, names: Sequence[str], found: Hypothesis, others: Sequence[Hypothesis]
) -> tuple[str, ...]:
    """Labels of the effects that cannot be told from one that was found.

    Args:
        equations: of all recordings.
        names: columns of the model.
        found: the effect.
        others: all that may be missing.
    """
    labels = [h.label for h in others if h.label != found.label and _parallel(equations, names, found, h) > PARALLEL]
    return tuple(dict.fromkeys(labels))


def lateness_sentence(equations: LinearEquations, names: Sequence[str], found: Hypothesis) -> str:
    """One lateness for all joints, or friction: what the joints say one by one."""
    (size,) = found.sizes
    by_joint = {}
    for gear in sorted({place.name for place in equations.places if place.name.endswith(".gear")}):
        own = equations.only(gear)
        late, sigma = own.fitted([*names, size])[-1], np.sqrt(own.spread([*names, size])[-1, -1])
        by_joint[gear.removesuffix(".gear")] = float(late), float(sigma)
    said = ", ".join(f"{joint} {1e3 * late:.2f} +- {1e3 * sigma:.2f} ms" for joint, (late, sigma) in by_joint.items())
    late = np.array([value for value, _ in by_joint.values()])
    sentence = (
        f"{found.owner} is late against the motor encoders: {said}, joint by joint. A part that goes with the speed "
        "looks like viscous friction or damping before the spring, too, and the two cannot be told apart in one joint"
    )
    if np.all(late > 0.0) and len(late) > 1 and np.ptp(late) < ONE_TIME * np.mean(late):
        return (
            f"{sentence}; one time for all joints, and a sign that friction would not have (it holds the motor back), "
            "say that it is time"
        )
    return f"{sentence}; here the joints do not agree on one time, so damping remains possible"


def _parallel(equations: LinearEquations, names: Sequence[str], one: Hypothesis, other: Hypothesis) -> float:
    """Smallest share of the other's columns that those of one explain, over the equations that the other is in."""
    shares, k = [], len(names)
    for name in sorted({place.name for place in equations.places}):
        first, second = one.columns[: len(one.sizes)], other.columns[: len(other.sizes)]
        G = equations.only(name).reduced([*names, *first, *second])[1:, 1:]
        if not np.any(np.diag(G)[k + len(first) :]):
            continue
        beside = G[k:, k:] - G[k:, :k] @ solved_products(G[:k, :k], G[:k, k:])
        a, b = np.split(np.arange(len(beside)), [len(first)])
        size = float(np.trace(beside[np.ix_(b, b)]))
        explained = beside[np.ix_(b, a)] @ solved_products(beside[np.ix_(a, a)], beside[np.ix_(a, b)])
        shares.append(float(np.trace(explained)) / size if size > 0.0 else 0.0)
    return float(np.sqrt(max(min(shares, default=0.0), 0.0)))
