# SPDX-License-Identifier: BSD-3-Clause
"""Effects between the logged command and the one that acts on the motor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.effect_kinds.effect import Effect

Array = NDArray[np.float64]
CommandLaw = Callable[[Array, Array, Mapping[str, float]], tuple[Array, dict[str, Array]]]


@dataclass(frozen=True, kw_only=True)
class CommandEffect(Effect):
    """A change of the command.

    Attributes:
        law: maps the edges of the steps, shape (m + 1,) [s], the logged commands of one joint, held over each step,
            shape (m,), and the parameters to the mean command that acts in each step, shape (m,), and its derivative
            by each parameter, by name, shape (m,) each. At the null values the command comes back unchanged and the
            derivatives are those from above.
    """

    law: CommandLaw = field(repr=False)
