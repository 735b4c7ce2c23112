# SPDX-License-Identifier: BSD-3-Clause
"""An arm that was shaken in one pose: spectra of its torques and motions, of its dry friction, and what carries it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.responses.response_matrix import ResponseMatrix, response_matrix
from jointscope.graphs.responses.spectra import Spectra, spectra, steady_spectra
from jointscope.robots.recordings.signals import Excitation, Signal, Signals

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
FINER = 4  # times the sampling rate: friction turns over within milliseconds, and what folds back is not of its line
VELOCITY_BAND = 0.8  # of half the rate: beyond it positions tell nothing but noise of the velocity that friction sees


@dataclass(frozen=True)
class ShakenPose:
    """A pose.

    Attributes:
        signals: torques of the motors that are shaken, and their positions.
        sha256: of the bag.
        q: mean positions of all joints, shape (n,) [rad].
        found: spectra of torques and positions.
        matrix: response from torques to positions.
        lines: that are used, in multiples of f0, shape (l,).
        carrier: complex amplitude of the motion that goes on beside the excitation, of each motor, shape (nu,) [rad].
        reach: how far beyond the highest line motion counts: up to so many times its frequency.
    """

    signals: Signals
    sha256: str
    q: Array
    found: Spectra
    matrix: ResponseMatrix
    lines: NDArray[np.intp]
    carrier: Complex
    reach: int = 1

    @staticmethod
    def of(signals: Signals, excitation: Excitation) -> ShakenPose:
        """The pose of a recording whose outputs are the positions of all joints.

        Raises:
            RecordingError: it shows no response.
        """
        places = [signals.outputs.names.index(joint) for joint in signals.inputs.names]
        own = replace(signals.outputs, values=signals.outputs.values[:, places], names=signals.inputs.names)
        motors = replace(signals, outputs=own)
        found = spectra(motors, excitation)
        step = _carrier_line(excitation)
        together = found.Y if found.common is None else found.common
        carrier = together[:, :, step].mean(axis=(0, 1)) if step else np.zeros(len(places), dtype=complex)
        lines = excitation.lines
        if step and found.common is None:  # no pairs: what carries the excitation stands on its own lines
            lines = lines[lines % step != 0]
        q = signals.outputs.values.mean(axis=0)
        return ShakenPose(motors, signals.sha256, q, found, response_matrix(found), lines, carrier)

    @property
    def path(self) -> str:
        """Of the bag."""
        return self.signals.path

    @property
    def step(self) -> int:
        """Line of the carrying motion; 0 for none."""
        return _carrier_line(self.found.excitation)

    @property
    def w(self) -> Array:
        """Of the lines, shape (l,) [rad/s]."""
        return np.asarray(2.0 * np.pi * self.found.excitation.f0 * self.lines)

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which lines of the matrix are used, shape (L,)."""
        return np.asarray(np.isin(self.found.excitation.lines, self.lines))

    @cached_property
    def motion(self) -> Complex:
        """Positions of the motors at all lines up to some beyond the highest one, shape (e, K, nu) [rad]."""
        K = min(self.reach * int(self.lines.max()) + 1 + 7 * max(self.step, 1), self.found.Y.shape[2])
        return np.asarray(self.found.Y[:, :, :K].mean(axis=1))

    @cached_property
    def motions(self) -> Complex:
        """The same in every experiment as it was, each sign by itself, shape (b, K, nu) [rad]."""
        return self._each_sign(self.motion.shape[1])

    @cached_property
    def whole_motions(self) -> Complex:
        """The same at all lines of the band of the velocities, shape (b, K', nu) [rad]."""
        return self._each_sign(1 + int(VELOCITY_BAND * (self.found.Y.shape[2] - 1)))

    @cached_property
    def whole_torques(self) -> Complex:
        """Torques of the motors at all lines in every experiment as it was, shape (b, K, nu) [N m]."""
        return self._of_signs(*steady_spectra(self.signals.inputs, self.found.excitation, self.path))

    def _each_sign(self, count: int) -> Complex:
        """Positions at the first lines in every experiment as it was, shape (b, count, nu) [rad]."""
        common = self.found.common
        return self._of_signs(self.found.Y[:, :, :count], None if common is None else common[:, :, :count])

    def _of_signs(self, odd: Complex, common: Complex | None) -> Complex:
        """What both signs have, shape (b, K, nu), of the half of their difference and of their sum."""
        half, both = odd.mean(axis=1), 0.0 if common is None else common.mean(axis=1)
        return np.asarray((both + self._signs[:, :, None, None] * half).reshape(-1, *half.shape[1:]))

    def both_signs(self, each: Complex) -> Complex:
        """What every experiment has by itself, shape (b, ...), as spectra of this pose have it, shape (e, ...)."""
        signs = self._signs
        every = each.reshape(*signs.shape, *each.shape[1:])
        return np.asarray(np.einsum("se,se...->e...", signs, every) / len(signs))

    @property
    def _signs(self) -> Array:
        """Of the excitation, both of a pair, shape (2, e), or those of single experiments, shape (1, e)."""
        order = sorted(self.found.excitation.experiments, key=lambda e: (e.realisation, e.number))
        if self.found.common is None:
            return np.array([[e.sign for e in order]], dtype=np.float64)
        return np.outer([1.0, -1.0], np.ones(len(self.motion)))

    @cached_property
    def torques(self) -> Complex:
        """Of the motors at the lines, shape (e, l, nu) [N m]."""
        return np.asarray(self.found.U.mean(axis=1)[:, self.lines])

    def friction(self, sharpness: Array) -> tuple[Complex, Complex]:
        """Dry friction of unit size at the lines, tanh(k v) of each motor, and its derivative by log k.

        Args:
            sharpness: k of each motor, shape (nu,) [s/rad].

        Returns:
            Shape (e, l, nu) each.
        """
        key = sharpness.tobytes()
        if key not in self._frictions:  # several begins ask for the same
            self._frictions[key] = self._friction(sharpness)
        return self._frictions[key]

    @cached_property
    def _frictions(self) -> dict[bytes, tuple[Complex, Complex]]:
        return {}

    def _friction(self, sharpness: Array) -> tuple[Complex, Complex]:
        def law(x: Array) -> Array:
            y = sharpness * self._velocity(x, VELOCITY_BAND)
            t = np.tanh(y)
            return np.concatenate([t, y * (1.0 - t * t)], axis=2)

        size, sharper = np.split(self._of_positions(law), 2, axis=2)
        return size, sharper

    def friction_doubt(self, sharpness: Array, share: float = 1.0) -> Complex:
        """What the upper half of a share of the band of the velocities is worth in friction of unit size."""

        def law(x: Array) -> Array:
            fine, coarse = (np.tanh(sharpness * self._velocity(x, part * share * VELOCITY_BAND)) for part in (1.0, 0.5))
            return np.asarray(fine - coarse)

        return self._of_positions(law)

    def changes(self, sharpness: Array) -> tuple[Complex, Complex, Complex]:
        """What changes from period to period, which is noise, with all that one cause does to different lines.

        Args:
            sharpness: k of each motor, shape (nu,) [s/rad].

        Returns:
            Torques, positions and friction of unit size, shape (s, e, l, nu) each, scaled so that their squares add up
            to the variance of a mean over all periods; s is 0 with one period.
        """

        def law(x: Array) -> Array:
            return np.asarray(np.tanh(sharpness * self._velocity(x, VELOCITY_BAND)))

        ways = (self.signals.inputs, None), (self.signals.outputs, None), (self.signals.outputs, law)
        torques, positions, friction = (self._changed(*way) for way in ways)
        return torques, positions, friction

    def _changed(self, signal: Signal, law: Callable[[Array], Array] | None) -> Complex:
        kinds = [x for x in steady_spectra(signal, self.found.excitation, self.path, law) if x is not None]
        P = self.found.periods
        each = [np.swapaxes(x - x.mean(axis=1, keepdims=True), 0, 1)[:, :, self.lines] for x in kinds]
        return np.asarray(np.concatenate(each)[: 0 if P < 2 else None] / np.sqrt(max(P * (P - 1), 1) * len(kinds)))

    def _of_positions(self, law: Callable[[Array], Array]) -> Complex:
        """Of the mean over periods: noise of a velocity rounds off what turns over, and the mean has less of it."""

        def mean(x: Array) -> Array:
            return law(x.mean(axis=0, keepdims=True))

        found, _ = steady_spectra(self.signals.outputs, self.found.excitation, self.path, mean)
        return np.asarray(found.mean(axis=1)[:, self.lines])

    def _velocity(self, x: Array, band: float) -> Array:
        """Velocities from periods of positions, shape (p, FINER N, c) [rad/s], up to a share of half the rate."""
        X, k = np.fft.rfft(x, axis=1), np.arange(x.shape[1] // 2 + 1)
        w = np.where(k <= band * k[-1], 2j * np.pi * self.found.excitation.f0 * k, 0.0)
        return np.asarray(FINER * np.fft.irfft(X * w[None, :, None], FINER * x.shape[1], axis=1))


def _carrier_line(excitation: Excitation) -> int:
    return round(excitation.carrier / excitation.f0)
