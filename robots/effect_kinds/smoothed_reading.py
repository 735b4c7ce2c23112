# SPDX-License-Identifier: BSD-3-Clause
"""Effects of filters between what an encoder sees and what it reads.

A filter with gain 1 weighs what came before; with m the mean age of its weights and s^2 their variance

    reading(t) = q(t - m) + s^2 / 2 q''(t - m) + ...

A mean age is a delay, which is an effect of its own. What the variance does is no delay: fast motion reads smaller.
"""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.robots.effect_kinds.effect import Effect


@dataclass(frozen=True, kw_only=True)
class SmoothedReading(Effect):
    """Readings of an encoder that are means over some time about their stamps: of the owner joint, or of all.

    Attributes:
        variance: name of the parameter that is the variance of the weights over time [s^2].
    """

    variance: str
