# SPDX-License-Identifier: BSD-3-Clause
"""Effects on when a sample was really taken."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Effect

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class TimeShift(Effect):
    """Stamps that are late: the sample with stamp t was taken at t - late(t).

    Attributes:
        late: maps the stamps since the start of the recording, shape (m,) [s], and the parameters to the lateness and
            its derivative by each parameter, by name, shape (m,) each [s]; linear in the parameters.
        sensors: what an owner shifts: "encoder" (the owner joint's channel; all joints for owner robot), "gyro" (the
            owner), or "all" (every sensor, for owner robot; the owner gyro).
    """

    late: Callable[[Array, Mapping[str, float]], tuple[Array, dict[str, Array]]] = field(repr=False)
    sensors: str = "gyro"
