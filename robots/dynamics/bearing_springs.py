# SPDX-License-Identifier: BSD-3-Clause
"""Springs and dampers on the two hinges of each soft bearing: tau = -q / compliance - damping v."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.torque_terms import TorqueTerms
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]


class BearingSprings:
    """Torques on the hinges of all soft bearings.

    Args:
        effects: of the robot; others than soft bearings are ignored.
        layout: of the state.
        names: names of the free parameters.
    """

    def __init__(self, effects: Sequence[EffectAt], layout: StateLayout, names: tuple[str, ...]):
        self._layout, self._names = layout, names
        self._bearings = [h for h in effects if isinstance(h.effect, Structure) and h.effect.form == "bearing"]

    def add(self, terms: TorqueTerms, x: Array, values: Mapping[str, float]) -> None:
        """Adds the torques at states of shape (m, d)."""
        layout = self._layout
        for here in self._bearings:
            for axis in "xy":
                link = layout.links.index(f"{here.owner}.bearing_{axis}")
                names = here.parameter(f"compliance_{axis}"), here.parameter(f"damping_{axis}")
                compliance, damping = values[names[0]], values[names[1]]
                q, v = x[:, link], x[:, layout.n_link + link]
                terms.value[:, link] -= q / compliance + damping * v
                if terms.by_state is None or terms.by_parameter is None:
                    continue
                terms.by_state[:, link, link] -= 1.0 / compliance
                terms.by_state[:, link, layout.n_link + link] -= damping
                for name, slope in zip(names, (q / compliance**2, -v), strict=True):
                    if name in self._names:
                        terms.by_parameter[:, link, self._names.index(name)] += slope
