# SPDX-License-Identifier: BSD-3-Clause
"""How much structure is left in residuals: autocorrelation over short lags, and strength over time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.calibration_result import BagFit, CalibrationResult
from jointscope.graphs.noise.torque_memory import MEMORIES
from jointscope.robots.model.lasting_torques import lasting_torques
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

PART = 10  # samples for every lag at the least: autocorrelations over most of a recording are mostly chance
LAGS = 100  # samples; 0.1 s at 1 kHz, longer than any elastic mode of interest takes to turn
AS_EXPECTED = 1.25  # mean square of a channel's residual in sigmas, up to which it is as large as expected
WINDOW = 0.25  # [s]
ENDLESS = (
    0.1  # of the drive's torque, from which a torque by no law is no nuisance; no model that leaves more is adequate
)


def autocorrelation(residual: Array, lags: int = LAGS) -> Array:
    """Autocorrelation at lags 1, 2, ... of one channel.

    Args:
        residual: shape (m,); values that are not finite count as zero.
        lags: number of lags.

    Returns:
        Shape (min(lags, m - 1),).
    """
    r = np.where(np.isfinite(residual), residual, 0.0)
    r = r - r.mean()
    m = len(r)
    lags = min(lags, max(m - 1, 0))
    power = float(r @ r)
    if power == 0.0 or lags == 0:
        return np.zeros(lags)
    size = 1 << (2 * m - 1).bit_length()
    spectrum = np.fft.rfft(r, size)
    products = np.fft.irfft(np.abs(spectrum) ** 2, size)
    return products[1 : lags + 1] / power


def channel_memory(fit: BagFit, robot: Robot) -> dict[str, float]:
    """Largest autocorrelation of each channel's residual over short lags, beside what its states make.

    States follow the noise of a sensor that is slow for the motion. What is left is sigma^2 (1 - S) with a smoother S
    that is symmetric and has no elements above its diagonal's, so an autocorrelation down to -s / (1 - s), with s on
    the diagonal, is made by the smoother and says nothing of the model. Where residuals are larger than that, the model
    of their noise is wrong, too, and nothing is excused.
    """
    found: dict[str, float] = {}
    for name, series in fit.residuals.items():
        sensor = robot.sensors.get(name)
        for i, channel in enumerate(series.channels):
            rest = (series.measured - series.predicted)[:, i]
            rest = rest[np.isfinite(rest)]  # drivers that send a message for each joint leave the others open
            rho = autocorrelation(rest, min(LAGS, len(rest) // PART))
            by_smoother = 0.0
            if sensor is not None and i < len(series.chi2) and series.chi2[i] <= AS_EXPECTED:
                left = float(np.nanmean((series.sigma[:, i] / sensor.sigmas[i]) ** 2))  # 1 - s
                by_smoother = max(1.0 - left, 0.0) / max(left, 1e-12)
            beyond = np.where(rho < 0.0, np.maximum(-rho - by_smoother, 0.0), rho)
            found[channel] = float(np.max(beyond, initial=0.0))
    return found


def strength(times: Array, residual: Array) -> tuple[Array, Array]:
    """Root mean square of residuals in windows of time.

    Args:
        times: shape (m,) [s].
        residual: in sigmas, shape (m, c).

    Returns:
        Edges of the windows, shape (w + 1,) [s]; strength, shape (w, c), NaN where a window is empty.
    """
    count = max(int(np.ceil((times[-1] - times[0]) / WINDOW)), 1)
    edges = times[0] + WINDOW * np.arange(count + 1)
    which = np.clip(((times - times[0]) / WINDOW).astype(int), 0, count - 1)
    squares = np.nan_to_num(residual) ** 2
    sums = np.stack([np.bincount(which, column, count) for column in squares.T], axis=1)
    number = np.stack([np.bincount(which, column, count) for column in np.isfinite(residual).T.astype(float)], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return edges, np.sqrt(sums / number)


def endless_torque(result: CalibrationResult) -> str:
    """A sentence about random torques that are a good part of a drive's, where no memory was too long; else nothing.

    Such a torque follows whatever the model lacks, and the values beside it are those of a model without it.
    """
    robot, worst, where = result.robot, 0.0, ""
    if robot.noise.correlation_time != MEMORIES[-1]:
        return ""
    torques = lasting_torques(robot)
    gains = [
        robot.command_volts * robot.drive_parameter(joint, robot.drive_gain).value if robot.drive_gain else 1.0
        for joint in robot.joints
    ]
    for joint, gain, column in zip(robot.joints, gains, range(robot.n), strict=True):
        drive = max(float(np.sqrt(np.mean((gain * bag.commands[:, column]) ** 2))) for bag in result.bags)
        share = torques.get(f"{joint}.link", 0.0) / drive if drive > 0.0 else 0.0
        if share > worst:
            worst, where = share, joint
    if worst < ENDLESS:
        return ""
    return (
        f"At {where} torques come and go by no law, {100 * worst:.0f} % of the drive's, and no memory was long enough "
        "for them: a missing effect looks like this, and the other values bear it."
    )
