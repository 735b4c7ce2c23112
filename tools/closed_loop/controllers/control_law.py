# SPDX-License-Identifier: BSD-3-Clause
"""The contract of a law of control."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class ControlLaw(Protocol):
    """Made anew for each run where it has a memory."""

    def command(self, tick: int, x: Array) -> Array:
        """The command of a tick.

        Args:
            tick: its number.
            x: the state as it is known, in the layout of the model, shape (d,).

        Returns:
            Within the full command, shape (n_joints,), SI unit of the command.
        """
