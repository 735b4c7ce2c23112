# SPDX-License-Identifier: BSD-3-Clause
"""A sensor factor whose samples tell less than their sigma says, each by a factor of its own.

Variables: those of the sensor. A quantized encoder in slow motion repeats one error many times; taken as independent,
its samples would promise a precision that averaging them cannot reach.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.factor import Factor, Samples
from jointscope.factors.seen_through import SeenThrough

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RescaledFactor(SeenThrough[Factor]):
    """A factor with larger sigmas.

    Attributes:
        scale: factor on the sigma of each row of each sample, shape (m, r).
    """

    scale: Array

    @property
    def sigmas(self) -> Array:
        """Rescaled standard deviations, shape (m, r)."""
        return self.inner.sigmas * self.scale

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""
        return replace(super().select(samples), scale=self.scale[samples])
