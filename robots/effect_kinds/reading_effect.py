# SPDX-License-Identifier: BSD-3-Clause
"""Effects between what a sensor is exposed to and what it reads, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from jointscope.robots.effect_kinds.effect import Effect


@dataclass(frozen=True, kw_only=True)
class ReadingEffect(Effect):
    """A change of readings: of the owner joint's encoder, or of the three axes of the owner gyro.

    Attributes:
        law: maps the undisturbed reading without its zero or bias, shape (m, c) (c = 1 for a joint, 3 for a gyro,
            complex while derivatives are taken), the time since the start of the recording, shape (m,) [s], and the
            parameters to the reading's error, shape (m, c); complex-safe.
    """

    law: Callable[[Any, Any, Mapping[str, Any]], Any] = field(repr=False)
