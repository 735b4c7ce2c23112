# SPDX-License-Identifier: BSD-3-Clause
"""The sigma of an encoder, from what a calibration leaves of its samples.

    sigma^2 <- sigma^2 times sum of squares / (samples - leverages)

where residuals are white: they are noise, and as large as they are. Coloured residuals are something that the model
lacks, and no sigma may hide it; but one that had fallen may come back to what was stated. For the same reason none is
raised beyond what neighbouring samples differ by: a missing effect bends the motion, it does not make samples jump.
Process noise is estimated in the same way beside it, see noise_estimation.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.stages.residual_series import ResidualSeries
from jointscope.graphs.problem.coarse_encoder import COARSE, encoder_steps
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import LinkEncoder, MotorEncoder
from jointscope.robots.recordings.recording import Recording, Stream

Array = NDArray[np.float64]

AGREES = (0.8, 1.25)  # mean squared residual in sigmas that asks for no other sigma
COLOUR = 0.25  # largest autocorrelation of white residuals; a quantized encoder reaches 0.2
LAGS = 100  # samples
BY_CHANCE = 4.0  # [1/sqrt(samples)] autocorrelation that white noise may show
FOURTH_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / np.sqrt(70.0)
SIXTH_DIFFERENCE = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0]) / np.sqrt(924.0)
ALIKE = 0.15  # relative difference of what both say about white noise
TOO_SMALL = 1.5  # times the sigma, noise that the samples show by themselves
ALTERNATING, FAR = -0.6, 4.0  # correlation of neighbouring differences, and [sigma] beyond which none counts more
TYPICAL = 1.4826  # standard deviation of normal numbers over the median of their sizes


@dataclass(frozen=True)
class EncoderFit:
    """What is left of one encoder in one recording: its samples, and the series of residuals."""

    stream: Stream
    series: ResidualSeries

    def is_white(self, channel: int) -> bool:
        """Whether what is left of a channel has no memory."""
        return _is_white(self.series.measured[:, channel] - self.series.predicted[:, channel])


def estimated_sigmas(encoder: MotorEncoder | LinkEncoder, fits: list[EncoderFit], stated: Array) -> Array:
    """Sigma of each channel that the residuals ask for, shape (n,); as it was where they do not tell.

    Args:
        encoder: with the sigmas that were used.
        fits: of all recordings.
        stated: sigmas before any was found anew, shape (n,).
    """
    sigmas = encoder.sigmas.copy()
    if not encoder.estimate_sigma or not fits:
        return sigmas
    weights = [len(fit.series.times) for fit in fits]
    chi2 = np.average([fit.series.chi2 for fit in fits], axis=0, weights=weights)
    lowest = np.max([_rounding(fit.stream, encoder.sigmas) for fit in fits], axis=0)
    highest = np.max([_roughness(fit.stream.measured) for fit in fits], axis=0)
    for j in np.flatnonzero((chi2 < AGREES[0]) | (chi2 > AGREES[1])):
        wanted, white = float(sigmas[j] * np.sqrt(chi2[j])), all(fit.is_white(int(j)) for fit in fits)
        if wanted < sigmas[j]:  # hides nothing, whatever colour is left
            sigmas[j] = min(max(wanted, lowest[j]), sigmas[j])
        else:
            # one that fell where states followed the samples, while the noise of the motion was loose, may come back
            bound = max(highest[j] if white else 0.0, stated[j])
            sigmas[j] = max(min(wanted, bound), sigmas[j])
    return sigmas


def with_visible_noise(robot: Robot, recordings: Sequence[Recording]) -> Robot:
    """The robot with sigmas that are not far below what every look at the samples shows.

    With a sigma that is too small the states follow the noise, which process noise then seems to explain. Differences
    of fourth and of sixth order see the same noise where it is white, and different parts of a motion; and those of
    white noise change their sign from one to the next, those of a motion do not.
    """
    changed = {}
    for encoder in (robot.motor_encoder, robot.link_encoder):
        if encoder is None or not encoder.estimate_sigma:
            continue
        seen = np.min([_visible_noise(r.streams[encoder.name].measured) for r in recordings], axis=0)
        sigmas = np.where(seen > TOO_SMALL * encoder.sigmas, seen, encoder.sigmas)
        changed[encoder.name] = replace(encoder, sigmas=sigmas)
    return robot.with_sensors(changed)


def _visible_noise(values: Array) -> Array:
    """White noise of each channel, shape (n,); zero where it cannot be told from motion. NaN was not measured."""
    found = []
    for column in _measured(values):
        if len(column) < 4 * len(SIXTH_DIFFERENCE):
            found.append(0.0)
            continue
        parts = [np.convolve(column, weights, mode="valid") for weights in (FOURTH_DIFFERENCE, SIXTH_DIFFERENCE)]
        fourth, sixth = (TYPICAL * float(np.median(np.abs(part))) for part in parts)
        alike = abs(fourth - sixth) < ALIKE * sixth and all(map(_alternates, parts))
        found.append(sixth if alike else 0.0)
    return np.array(found)


def _alternates(differences: Array) -> bool:
    """Whether differences of order n are those of white noise, correlated by -n / (n + 1) from one to the next."""
    typical = TYPICAL * float(np.median(np.abs(differences)))
    part = np.clip(differences, -FAR * typical, FAR * typical)
    return float(part[:-1] @ part[1:]) < ALTERNATING * float(part @ part)


def _rounding(stream: Stream, sigmas: Array) -> Array:
    """Standard deviation of the rounding of a quantized encoder, shape (n,); zero for others."""
    step = encoder_steps(stream.measured)
    return np.asarray(np.where(step > COARSE * sigmas, step, 0.0) / np.sqrt(12.0), dtype=np.float64)


def _roughness(values: Array) -> Array:
    """Noise that would explain by how much neighbouring samples differ, shape (n,)."""
    found = np.zeros(values.shape[1])
    for j, column in enumerate(_measured(values)):
        if len(column) >= 2 * len(FOURTH_DIFFERENCE):
            found[j] = np.sqrt(np.mean(np.convolve(column, FOURTH_DIFFERENCE, mode="valid") ** 2))
    return found


def _measured(values: Array) -> list[Array]:
    """The samples of each channel that were measured."""
    return [column[np.isfinite(column)] for column in values.T]


def _is_white(residual: Array) -> bool:
    r = residual[np.isfinite(residual)]
    r = r - r.mean()
    power = float(r @ r)
    if power == 0.0:
        return False
    lags = range(1, min(LAGS, len(r) // 4) + 1)
    largest = max((abs(float(r[:-lag] @ r[lag:])) / power for lag in lags), default=1.0)
    return largest < max(COLOUR, BY_CHANCE / np.sqrt(len(r)))
