# SPDX-License-Identifier: BSD-3-Clause
"""Response matrices of systems that others recorded: a motor bench with two masses, and a mirror on piezo actuators.

Nothing is said of their excitation: period, lines and experiments are found. One model of two masses, spring, damper
and viscous friction on both sides, fitted to recording A of the bench, predicts recording B.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from jointscope.graphs.responses.find_excitation import find_excitation
from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.graphs.responses.response_matrix import response_matrix
from jointscope.graphs.responses.spectra import spectra
from jointscope.robots.recordings.signals import Signal, Signals

Tell = Callable[[str], None]
Array = NDArray[np.float64]
REAL = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "real"
PUBLISHED = {"300mV": (5.63, 4.2), "100mV": (8.4, 6.4)}  # [%] of the mirror: linear model of order 28, nonlinear one


def system_rows(tell: Tell) -> dict[str, Any]:
    """Figures of both systems; `tell` takes each line."""
    return {"bench": bench_rows(tell), "mirror": [mirror_row(size, tell) for size in PUBLISHED]}


def bench(letter: str, angles: bool = False) -> MeasuredResponse:
    """Motor current to speeds, which the source has filtered, or to angles of motor and load, of a recording."""
    z = np.load(REAL / "two_mass_multisine" / f"two_mass_multisine_{letter}.npz")
    t = np.arange(len(z["iq_adx"].ravel())) / float(z["rate_hz"])
    current, drive = (Signal(t, z[name].reshape(-1, 1).astype(float), ("current",)) for name in ("iq_adx", "iq_refx"))
    motor, load = ("theta_mx", "theta_my") if angles else ("omega_max", "omega_may")
    both = np.stack([z[motor].ravel(), -z[load].ravel()], axis=1).astype(float)
    both = both - np.outer(t, (both[-1] - both[0]) / t[-1]) if angles else both  # they drift
    signals = Signals(letter, "", current, Signal(t, both, ("motor", "load")))
    return MeasuredResponse.of(signals, find_excitation(drive, 1, letter))


def bench_rows(tell: Tell) -> dict[str, Any]:
    """Roots, distortions, and what the model of A makes of B."""
    A, B = bench("A"), bench("B")
    tell("| motor bench | anti-resonance, motor side | resonance, motor side | load side |\n| --- | --- | --- | --- |")
    for found in (A, B):
        roots = {(r.output, r.anti): f"{r.frequency:.2f} ± {r.frequency_sigma:.2f} Hz" for r in found.resonances}
        cells = [roots.get(key, "-") for key in ((0, True), (0, False), (1, False))]
        tell(f"| {found.spectra.path} | {' | '.join(cells)} |")
    d = B.distortions
    assert d is not None
    levels = [d.noise, d.even, d.odd]
    sizes = [1e3 * float(np.mean(level.size[level.frequencies < 60.0])) for level in levels]
    tell(
        f"\nB, speed below 60 Hz at lines that were not excited: even {sizes[1]:.2f}, odd {sizes[2]:.2f} mrad/s, "
        f"noise {sizes[0]:.2f} mrad/s."
    )
    A, B = bench("A", angles=True), bench("B", angles=True)
    x, misfit = two_masses(A)
    f, own = B.matrix.frequencies, B.matrix.G[:, :, 0]
    at = np.searchsorted(A.matrix.frequencies, f)
    ways = {"model of two masses": two_mass_response(f, x), "matrix of A": A.matrix.G[at, :, 0]}
    floor = float(np.linalg.norm(B.matrix.sigmas(B.matrix.total)[:, :, 0]) / np.linalg.norm(own))
    miss = {way: float(np.linalg.norm(G - own) / np.linalg.norm(own)) for way, G in ways.items()}
    tell(
        f"A predicts the angles of B to {100.0 * miss['model of two masses']:.1f} % (one model of two masses, fitted "
        f"to A with chi-square {misfit:.1f} per equation) and {100.0 * miss['matrix of A']:.1f} % (the matrix of A "
        f"itself); B is known to {100.0 * floor:.1f} %.\n"
    )
    return {"levels_mrad_s": sizes, "misfit": misfit, "miss": miss, "floor": floor, "values": x.tolist()}


def two_masses(found: MeasuredResponse) -> tuple[Array, float]:
    """Values of the model, and chi-square per equation."""
    f, G = found.matrix.frequencies, found.matrix.G[:, :, 0]
    sigma = found.matrix.sigmas(found.matrix.total)[:, :, 0]

    def residual(x: Array) -> Array:
        r = np.sqrt(2.0) * (two_mass_response(f, x) - G) / sigma
        return np.concatenate([r.real.ravel(), r.imag.ravel()])

    begin = _begin(f, G)
    fit = least_squares(residual, begin, bounds=(begin - 5.0, begin + 5.0), max_nfev=2000)
    return fit.x, float(2.0 * fit.cost / (len(fit.fun) - len(begin)))


def two_mass_response(f: Array, x: Array) -> NDArray[np.complex128]:
    """Angles of motor and load per current, shape (l, 2) [rad/A].

    Args:
        f: shape (l,) [Hz].
        x: logarithms of motor's and load's inertia, spring, damper, friction of motor and load, all over the torque
            constant; how late the angles of motor and load are [ms].
    """
    motor, load, spring, damper, own, others = np.exp(x[:6])
    s = 2j * np.pi * f
    k = spring / s + damper  # torque per difference of speeds
    Z1, Z2 = motor * s + own + k, load * s + others + k
    both = np.stack([Z2, k], axis=1) / (s * (Z1 * Z2 - k * k))[:, None]
    return np.asarray(both * np.exp(-1e-3 * s[:, None] * x[6:]))


def _begin(f: Array, G: NDArray[np.complex128]) -> Array:
    """Both masses from low lines, their ratio and the spring from dip and peak."""
    low = f < 25.0
    whole = 1.0 / float(np.mean(np.abs(G[low, 0]) * (2.0 * np.pi * f[low]) ** 2))
    dip, peak = 54.0, 76.0  # [Hz]
    load = whole * (1.0 - (dip / peak) ** 2)
    spring = load * (2.0 * np.pi * dip) ** 2
    values = [whole - load, load, spring, 0.02 * spring / (2.0 * np.pi * peak), 0.1 * whole, 0.1 * whole]
    return np.array([*np.log(values), 0.0, 0.0])


def mirror_row(size: str, tell: Tell) -> dict[str, Any]:
    """Noise and nonlinear part of the mirror's matrix, and how well it predicts the test part."""
    z = np.load(REAL / "fine_steering_mirror" / "fine_steering_mirror.npz")
    u, y = (z[f"{name}_{size}_train"].transpose(2, 3, 0, 1).reshape(-1, 3) for name in "uy")
    t = np.arange(len(u)) / float(z["rate_hz"])
    signals = Signals("mirror", "", Signal(t, u, ("a", "b", "c")), Signal(t, y, ("x", "y", "z")))
    excitation = find_excitation(signals.inputs, 3, "mirror")
    matrix = response_matrix(spectra(signals, excitation))
    assert matrix.noise is not None
    # noise is that of the mean of two blocks of two periods, half of what two periods of one block differ by / sqrt(2)
    periods = 100.0 * np.sqrt(8.0) * matrix.relative(matrix.noise)
    blocks = 100.0 * np.median(np.abs(matrix.each[0] - matrix.each[1]) / np.abs(matrix.G), axis=0)
    U, Y = (np.fft.rfft(z[f"{name}_{size}_test"].mean(axis=3), axis=0)[excitation.lines] for name in "uy")
    miss = 100.0 * float(np.linalg.norm(np.einsum("lij,ljr->lir", matrix.G, U) - Y) / np.linalg.norm(Y))
    linear, nonlinear = PUBLISHED[size]
    tell(
        f"Mirror, {size.replace('mV', ' mV')}: {len(excitation.lines)} lines, {len(excitation.experiments)} experiments"
        f"; entries differ by {periods.min():.1f} to {periods.max():.1f} % between periods (median "
        f"{np.median(periods):.1f} %) and {blocks.min():.0f} to {blocks.max():.0f} % between blocks; the response "
        f"predicts the test part to {miss:.1f} % (published: linear {linear:.1f}, nonlinear {nonlinear:.1f} %)."
    )
    return {"size": size, "periods": periods.tolist(), "blocks": blocks.tolist(), "miss": miss}
