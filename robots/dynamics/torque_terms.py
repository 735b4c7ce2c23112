# SPDX-License-Identifier: BSD-3-Clause
"""Torques of all equations of motion and the rates of memories, summed law by law with their derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.parts.state_layout import StateLayout

Array = NDArray[np.float64]
Rows = int | NDArray[np.intp] | slice


@dataclass
class TorqueTerms:
    """Right-hand sides of m samples: link torques, motor torques [N m], rates of memories.

    Attributes:
        value: shape (m, r) with r = n_link + n_motor + memories.
        by_state: derivative by the state, shape (m, r, d); None where not wanted.
        by_parameter: derivative by the free parameters, shape (m, r, p); None where not wanted.
    """

    value: Array
    by_state: Array | None = None
    by_parameter: Array | None = None

    @staticmethod
    def zeros(m: int, layout: StateLayout, parameters: int, derivatives: bool) -> TorqueTerms:
        """No torques."""
        r = layout.n_rates
        if not derivatives:
            return TorqueTerms(np.zeros((m, r)))
        return TorqueTerms(np.zeros((m, r)), np.zeros((m, r, layout.size)), np.zeros((m, r, parameters)))
