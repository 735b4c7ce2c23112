# SPDX-License-Identifier: BSD-3-Clause
"""A sensor whose reading is disturbed by effects: scale errors, eccentric discs, drifting bias.

    residual = undisturbed residual + sum of errors(undisturbed reading, t)

Variables: those of the sensor, and dynamics (which holds the parameters of all effects).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration, bias_block
from jointscope.factors.factor import Linearization, Samples
from jointscope.factors.gyro import GyroFactor
from jointscope.factors.link_encoder import LinkEncoderFactor
from jointscope.factors.motor_encoder import MotorEncoderFactor
from jointscope.factors.seen_through import SeenThrough
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect

Array = NDArray[np.float64]
STEP = 1e-30  # [unit of the signal] of complex derivatives


@dataclass(frozen=True)
class DistortedFactor(SeenThrough[GyroFactor | LinkEncoderFactor | MotorEncoderFactor]):
    """A sensor factor on one state with effects on its reading.

    Attributes:
        effects: what disturbs it, and the channels that each acts on.
        times: stamps since the start of the recording, shape (m,) [s].
        fixed: parameters that calibration leaves alone, by full name.
    """

    effects: tuple[tuple[EffectAt, NDArray[np.intp]], ...]
    times: Array
    fixed: Mapping[str, float]

    @property
    def blocks(self) -> tuple[str, ...]:
        """Blocks of the sensor, and dynamics."""
        return (*self.inner.blocks, DYNAMICS)

    def select(self, samples: Samples) -> Self:
        """The same factor for some of the samples."""
        return replace(super().select(samples), times=self.times[samples])

    def residual(self, x: tuple[Array, ...], calibration: Calibration) -> Array:
        """Predicted - measured, shape (m, c)."""
        residual = self.inner.residual(x, calibration)
        reading, values = self._undisturbed(residual, calibration), self._values(calibration)
        total = residual.copy()
        for here, channels in self.effects:
            total[:, channels] += self._error(here, reading[:, channels], here.own(values))
        return total

    def linearize(self, x: tuple[Array, ...], calibration: Calibration) -> Linearization:
        """Residual and derivatives."""
        inner = self.inner.linearize(x, calibration)
        reading, values = self._undisturbed(inner.residual, calibration), self._values(calibration)
        residual, names = inner.residual.copy(), calibration.names
        # derivative of the disturbed by the undisturbed reading
        gain = np.broadcast_to(np.eye(residual.shape[1]), (*residual.shape, residual.shape[1])).copy()
        by_dynamics = np.zeros((*residual.shape, len(names)))
        for here, channels in self.effects:
            part, p = reading[:, channels], here.own(values)
            residual[:, channels] += self._error(here, part, p)
            for i, channel in enumerate(channels):
                moved = part.astype(complex)
                moved[:, i] += 1j * STEP
                gain[:, channels, channel] += np.imag(self._law(here, moved, p)) / STEP
            for name, value in p.items():
                full = here.parameter(name)
                if full in names:
                    slope = np.imag(self._law(here, part, {**p, name: value + 1j * STEP})) / STEP
                    by_dynamics[:, channels, names.index(full)] += slope
        by_block = {
            block: np.asarray(J) if block.endswith(".bias") else gain @ J for block, J in inner.by_block.items()
        }
        by_block[DYNAMICS] = by_dynamics * calibration.value_by_coordinate
        return Linearization(residual, tuple(gain @ J for J in inner.by_state), by_block)

    def _undisturbed(self, residual: Array, calibration: Calibration) -> Array:
        """Reading without zero, bias and effects, shape (m, c)."""
        if isinstance(self.inner, GyroFactor):
            return residual + self.inner.measured - calibration[bias_block(self.inner.name)]
        return residual + self.inner.measured - self.inner.sensor.zero

    def _values(self, calibration: Calibration) -> dict[str, float]:
        return {**self.fixed, **calibration.by_name}

    def _error(self, here: EffectAt, reading: Array, p: Mapping[str, float]) -> Array:
        return np.asarray(np.real(self._law(here, reading, p)), dtype=np.float64)

    def _law(self, here: EffectAt, reading: Array, p: Mapping[str, complex]) -> NDArray[np.complex128]:
        assert isinstance(here.effect, ReadingEffect)
        return np.asarray(here.effect.law(reading, self.times, p))
