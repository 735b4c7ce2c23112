# SPDX-License-Identifier: BSD-3-Clause
"""The missing torque over time with its sigma, and its spectrum, equation by equation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from jointscope.graphs.discovery.missing_torque import MissingTorque
from jointscope.robots.units import joined
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Key, Section, figure, foldable
from jointscope.tools.report.page.panels import below_each_other
from jointscope.tools.report.page.plot import Axes, Band, Curve, Mark, plot
from jointscope.tools.report.sections.diagnosis.torque_maps import NOT_ESTIMATED, candidate_colour, candidate_keys

SHOWN = 2  # equations that lack most; the others fold
GROUP = "missing"
Array = NDArray[np.float64]

SEGMENT = 2.0  # [s] resolves half a hertz
POINTS = 160  # on the logarithmic axis


def torque_over_time(missing: MissingTorque | None) -> Section:
    """The equations that lack most, the others folded; then all spectra."""
    title = "The missing torque over time"
    lead = (
        "When it appears, with the ±2 sigma band of its estimate: what stays inside the band is not there. Below, at "
        "which frequencies: friction is low and broad, cogging follows the speed, a resonance is a peak."
    )
    if missing is None or not len(missing.times):
        return Section("torque", title, NOT_ESTIMATED, lead)
    excess = np.sqrt(np.mean(missing.torque**2, axis=0)) / np.maximum(np.median(missing.sigma, axis=0), 1e-12)
    order = [int(i) for i in np.argsort(-excess)]
    keys = [Key("missing torque", "m0"), Key("±2 sigma", "soft", "band"), *candidate_keys(missing)]
    body = figure(_panels(missing, order[:SHOWN]), keys, group=GROUP)
    if order[SHOWN:]:
        body += foldable(
            f"{len(order) - SHOWN} more equations", figure(_panels(missing, order[SHOWN:]), keys, group=GROUP)
        )
    body += "<h3>Spectrum</h3>" + _spectra(missing, order)
    return Section("torque", title, body, lead)


def _panels(missing: MissingTorque, rows: list[int]) -> list[str]:
    panels = []
    limits = (float(missing.times[0]), float(missing.times[-1]))
    for i in rows:
        t, torque, sigma = missing.times, missing.torque[:, i], missing.sigma[:, i]
        rms = significant(float(np.sqrt(np.mean(torque**2))))
        marks: list[Mark] = [
            Band("±2 sigma", t, -2.0 * sigma, 2.0 * sigma, "soft"),
            Curve("missing torque", t, torque, "m0"),
        ]
        for label, curve in missing.explained_by.items():
            if np.any(curve[:, i]):
                marks.append(Curve(label, t, curve[:, i], candidate_colour(missing, label), "dashed"))
        unit = missing.unit(missing.rows[i], "N m")
        title = f"{missing.rows[i]} [{unit}], rms {rms} {unit}"
        panels.append((Axes(title, height=150, x_range=limits), marks))
    return below_each_other(panels)


def _spectra(missing: MissingTorque, order: list[int]) -> str:
    f, density = torque_spectrum(missing.times, missing.torque)
    if not len(f):
        return "<p>The recording is too short for a spectrum.</p>"
    curves = [
        Curve(missing.rows[i], f, np.maximum(density[:, i], 1e-12), f"k{i % 6}", "thick" if k == 0 else "solid")
        for k, i in enumerate(order)
    ]
    units = joined([f"{missing.unit(row, 'N m')}/√Hz" for row in missing.rows])
    axes = Axes(f"spectral density [{units}]", "frequency [Hz]", height=250, log_x=True, log_y=True)
    return figure([plot(axes, curves)], [Key(missing.rows[i], f"k{i % 6}") for i in order])


def torque_spectrum(times: Array, torque: Array) -> tuple[Array, Array]:
    """Spectral density of each column.

    Args:
        times: shape (m,) [s]; uneven ones are resampled.
        torque: shape (m, c) [N m].

    Returns:
        Frequencies, shape (k,) [Hz], and densities, shape (k, c) [N m/√Hz], averaged in even steps of log f.
    """
    if len(times) < 16:
        return np.zeros(0), np.zeros((0, torque.shape[1]))
    step = float(np.median(np.diff(times)))
    even = np.arange(times[0], times[-1], step)
    values = np.column_stack([np.interp(even, times, column) for column in torque.T])
    length = min(len(even), max(round(SEGMENT / step), 16))
    f, power = welch(values, 1.0 / step, nperseg=length, axis=0)
    return _averaged(f[1:], power[1:])


def _averaged(f: Array, power: Array) -> tuple[Array, Array]:
    edges = np.geomspace(f[0] * 0.999, f[-1] * 1.001, POINTS + 1)
    place = np.digitize(f, edges) - 1
    bins = np.unique(place)
    frequency = np.array([float(np.mean(f[place == k])) for k in bins])
    return frequency, np.sqrt(np.array([np.mean(power[place == k], axis=0) for k in bins]))
