# SPDX-License-Identifier: BSD-3-Clause
"""Torques by errors of the geometry, as differences of bodies a little to both sides along each of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.bodies.rigid_tree import RigidTree

Array = NDArray[np.float64]
DISPLACED = 1e-4  # [m], [rad] to both sides, over which torques are compared


class DisplacedBodies:
    """The bodies beside some values; those of the last values are kept.

    All samples are asked at the same values, piece after piece: to copy the bodies takes longer than a piece does.

    Args:
        names: of the errors.
        on: names of all values that change the bodies.
        build: the bodies at some values.
    """

    def __init__(
        self, names: Sequence[str], on: Sequence[str], build: Callable[[Mapping[str, float]], RigidTree]
    ) -> None:
        self._names, self._on, self._build = tuple(names), tuple(on), build
        self._kept: tuple[tuple[float, ...], list[tuple[RigidTree, RigidTree]]] | None = None

    def torques(
        self, tree: RigidTree, motion: tuple[Array, Array, Array], coriolis: float, values: Mapping[str, float]
    ) -> Iterator[tuple[str, Array]]:
        """Torque that a unit of each error of the geometry asks for, by name, shape (m, n_link) each.

        Args:
            tree: the bodies at the values.
            motion: positions, velocities and accelerations, shape (m, n_link) each.
            coriolis: share of the Coriolis terms, where the tree has them.
            values: of all parameters.
        """
        q, v, a = motion
        shares = {1.0: coriolis, 0.0: 1.0 - coriolis} if tree.coriolis else {0.0: 1.0}  # by speed
        used = [(speed * v, share) for speed, share in shares.items() if share]
        for name, ends in zip(self._names, self._ends(values), strict=True):
            ahead, behind = (sum(share * end.torque(q, w, a) for w, share in used) for end in ends)
            yield name, np.asarray(ahead - behind) / (2.0 * DISPLACED)

    def _ends(self, values: Mapping[str, float]) -> list[tuple[RigidTree, RigidTree]]:
        key = tuple(values[name] for name in self._on)
        known = self._kept  # another thread may put other bodies there
        if known is None or known[0] != key:
            each = ([self._build({**values, n: values[n] + s}) for s in (DISPLACED, -DISPLACED)] for n in self._names)
            known = self._kept = key, [(ahead, behind) for ahead, behind in each]
        return known[1]
