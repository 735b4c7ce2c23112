# SPDX-License-Identifier: BSD-3-Clause
"""Steady periods of an excited system as spectra, experiment by experiment.

X(k) = 1/N sum_n x(n) exp(-2 pi j k n / N) of each period; a cosine of amplitude a has |X| = a / 2. Two experiments that
differ in the sign of the excitation count as one, half their difference: what does not change its sign with the
excitation (gravity, a motion that carries it, even distortion) is not in it. Of values that are held until the next one
the spectrum is that of the steps, which is later by half a sample and smaller.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.signals import Excitation, Signal, Signals, whole_periods

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Change = Callable[[Array], Array]
CLIPPED = 2e-3  # share of samples that stay at exactly the largest or smallest value, as no signal within its limits
LEVELS = 16  # of a signal that switches between so few values: its limits are what was meant
ALIKE = 0.9  # correlation of the phases at all lines: the same phases
OPPOSITE = 0.3  # correlation of the phases of a pair, one of them with its sign turned: 1 by right, 0 by chance
ENOUGH = 9  # lines: the phases of fewer may be alike by chance
EXCITED = 3.0  # times what is between the lines, or what changes from period to period


@dataclass(frozen=True)
class Spectra:
    """Spectra of one recording.

    Attributes:
        path: of the recording.
        excitation: how it was excited.
        inputs, outputs: names of the channels.
        U: of the inputs, shape (e, p, K, nu): experiment, period, line.
        Y: of the outputs, shape (e, p, K, ny).
        common: half the sum of the pairs, of the outputs, shape (e, p, K, ny); None without pairs.
        realisations: number of each experiment's realisation, shape (e,); one that repeats the phases of another
            has its number.
    """

    path: str
    excitation: Excitation
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    U: Complex
    Y: Complex
    common: Complex | None
    realisations: NDArray[np.intp]

    @property
    def periods(self) -> int:
        """Of each experiment."""
        return int(self.U.shape[1])

    @property
    def frequencies(self) -> Array:
        """Of all lines, shape (K,) [Hz]."""
        return np.asarray(self.excitation.f0 * np.arange(self.U.shape[2]))

    @property
    def blocks(self) -> list[NDArray[np.intp]]:
        """Experiments that together excite all inputs: of each realisation, or all of them where that is too few."""
        numbers = list(dict.fromkeys(self.realisations.tolist()))
        each = [np.flatnonzero(self.realisations == r) for r in numbers]
        enough = all(len(block) >= len(self.inputs) for block in each)
        return each if enough else [np.arange(len(self.realisations))]


def spectra(signals: Signals, excitation: Excitation) -> Spectra:
    """The spectra of a recording.

    Raises:
        RecordingError: an experiment is not in it, periods are not whole, an input is clipped, a line not excited.
    """
    _check_clipping(signals)
    _check_rates(signals, excitation)
    _check_pairs(signals, excitation)
    (U, both), (Y, common) = (steady_spectra(s, excitation, signals.path) for s in (signals.inputs, signals.outputs))
    if both is not None:
        _check_opposite(U.mean(axis=1), both.mean(axis=1), excitation, signals.path)
    K = min(U.shape[2], Y.shape[2])
    made = Spectra(
        signals.path,
        excitation,
        signals.inputs.names,
        signals.outputs.names,
        U[:, :, :K],
        Y[:, :, :K],
        None if common is None else common[:, :, :K],
        _distinct(np.array([key[0] for key in _keys(excitation)], dtype=np.intp), U.mean(axis=1), excitation),
    )
    _check_excited(made)
    return made


def steady_spectra(
    signal: Signal, excitation: Excitation, path: str, change: Change | None = None
) -> tuple[Complex, Complex | None]:
    """Spectra of a signal's steady periods, both signs subtracted, shape (e, p, K, c), and half their sum.

    Args:
        signal: the samples.
        excitation: how it was excited; experiments have one sign, or all of them both.
        path: of the recording.
        change: made to the samples, period by period, shape (p, N, c), before their spectra are taken; it may return
            other channels, and more samples of the same time.

    Raises:
        RecordingError: an experiment is not in it, or periods are not whole.
    """
    N = whole_periods(excitation.f0, signal.step, path)
    steady = min(e.periods - e.transient for e in excitation.experiments)
    found: dict[tuple[int, int], dict[int, Complex]] = {key: {} for key in _keys(excitation)}
    for e in excitation.experiments:
        begin = e.start + (e.periods - steady) / excitation.f0
        x, first = signal.even(begin, steady * N, path)
        x = x.reshape(steady, N, -1)
        x = x if change is None else change(x)
        X = np.fft.rfft(x, axis=1) / x.shape[1]
        late = np.exp(-2j * np.pi * excitation.f0 * np.arange(X.shape[1]) * (first - begin))  # phases as of its start
        turns = np.arange(X.shape[1]) / N  # of each line from one sample to the next
        steps = np.sinc(turns) * np.exp(-1j * np.pi * turns) if signal.held else 1.0
        found[e.realisation, e.number][e.sign] = X * (late * steps)[None, :, None]
    pairs = list(found.values())
    if len(pairs[0]) == 1:
        return np.array([sign * X for pair in pairs for sign, X in pair.items()]), None
    return np.array([(p[1] - p[-1]) / 2 for p in pairs]), np.array([(p[1] + p[-1]) / 2 for p in pairs])


def _keys(excitation: Excitation) -> list[tuple[int, int]]:
    """Realisation and number of all experiments, pairs once."""
    return sorted({(e.realisation, e.number) for e in excitation.experiments})


def _distinct(numbers: NDArray[np.intp], U: Complex, excitation: Excitation) -> NDArray[np.intp]:
    """Numbers of realisations, shape (e,): the same phases again, shifted in time or not, are no other realisation.

    All that a nonlinear system does comes again with them, so their scatter is noise alone.
    """
    lines = excitation.lines
    if len(lines) < ENOUGH:
        return numbers
    U = U[:, lines] / np.maximum(np.linalg.norm(U[:, lines], axis=2, keepdims=True), 1e-300)
    shifts = 1 if excitation.carrier else 8 * (int(lines.max()) + 1)  # beside a motion the time matters, too
    merged = numbers.copy()
    for r in np.unique(numbers):
        for earlier in np.unique(merged[merged < r]):
            one, other = U[numbers == r], U[merged == earlier]
            cross = np.zeros((len(one), len(other), shifts // 2 + 1 if shifts > 1 else len(lines)), dtype=complex)
            products = np.einsum("alj,blj->abl", one, other.conj())
            if shifts > 1:
                cross[:, :, lines] = products
                alike = np.abs(np.fft.irfft(cross, shifts)).max(axis=2) * shifts / 2.0
            else:
                alike = np.abs(products.real.sum(axis=2))
            if np.all(alike.max(axis=1) > ALIKE * len(lines)):
                merged[numbers == r] = earlier
                break
    return merged


def _check_pairs(signals: Signals, excitation: Excitation) -> None:
    signs = {
        key: {e.sign for e in excitation.experiments if (e.realisation, e.number) == key} for key in _keys(excitation)
    }
    lonely = [key for key, both in signs.items() if len(both) == 1]
    if lonely and len(lonely) < len(signs):
        raise RecordingError(
            f"{signals.path}: experiment {lonely[0][1]} of realisation {lonely[0][0]} has one sign, others have both; "
            "leave it out, or record the other sign"
        )


def _check_opposite(U: Complex, both: Complex, excitation: Excitation, path: str) -> None:
    """Experiments of a pair must differ in the sign of their inputs.

    Raises:
        RecordingError: they do not.
    """
    for (realisation, number), half, rest in zip(_keys(excitation), U, both, strict=True):
        plus, minus = (rest + sign * half for sign in (1.0, -1.0))
        plus, minus = plus[excitation.lines], minus[excitation.lines]
        size = np.linalg.norm(plus, axis=1) * np.linalg.norm(minus, axis=1)
        alike = -np.sum(plus * minus.conj(), axis=1).real / np.maximum(size, 1e-300)
        if np.mean(alike) < OPPOSITE:
            raise RecordingError(
                f"{path}: the two signs of realisation {realisation}, experiment {number} are no pair: their inputs "
                f"are not opposite; correct sign, start or number of its experiments in {excitation.source}"
            )


def _check_rates(signals: Signals, excitation: Excitation) -> None:
    for signal in (signals.inputs, signals.outputs):
        highest = excitation.f0 * float(excitation.lines.max())
        if highest > 0.5 / signal.step:
            raise RecordingError(
                f"{signals.path}: {signal.names[0]} is sampled at {1.0 / signal.step:.4g} Hz, lines go up to "
                f"{highest:g} Hz: above half the rate they fold onto others; record faster or leave these lines out"
            )


def _check_clipping(signals: Signals) -> None:
    for name, u in zip(signals.inputs.names, signals.inputs.values.T, strict=True):
        if len(np.unique(u)) <= LEVELS:
            continue
        first = np.concatenate([[0], np.flatnonzero(np.diff(u)) + 1])
        length = np.diff(first, append=len(u))
        for limit in (u.max(), u.min()):
            at = u[first] == limit
            usual = np.median(length[~at])  # above one where a command comes more rarely than samples
            share = float(np.sum(np.maximum(length[at] - usual, 0))) / len(u)
            if share > CLIPPED:
                raise RecordingError(
                    f"{signals.path}: {name} stands at {limit:.4g} in {100.0 * share:.2g} % of the samples: it is "
                    "clipped, and what is lost comes back at all lines; excite less"
                )


def _check_excited(found: Spectra) -> None:
    """Every line must stand out from what changes between periods, in some experiment of some input.

    Raises:
        RecordingError: it does not.
    """
    lines = found.excitation.lines
    weak = weak_lines(found.U, lines)
    if len(weak) > 0.5 * len(lines):
        raise RecordingError(
            f"{found.path}: {len(weak)} of {len(lines)} lines of {found.excitation.source} are not excited; it belongs "
            "to another recording, or f0 or the start times are wrong"
        )
    if weak:
        raise RecordingError(
            f"{found.path}: nothing was excited at line {weak[0]} ({found.excitation.f0 * weak[0]:g} Hz)"
            + (f" and {len(weak) - 1} more" if len(weak) > 1 else "")
            + f"; take it out of the lines of {found.excitation.source}"
        )


def weak_lines(U: Complex, lines: NDArray[np.intp]) -> list[int]:
    """Lines that do not stand out of what is between them, or of what changes from period to period.

    Args:
        U: spectra, shape (e, p, K, nu).
        lines: that were excited.
    """
    size = np.sqrt(np.mean(np.abs(U) ** 2, axis=(0, 1)))
    between = np.setdiff1d(np.arange(1, min(int(lines.max()) + 2, len(size))), lines)
    floor = np.median(size[between], axis=0) if len(between) > 2 else np.zeros(size.shape[1])
    if U.shape[1] > 1:
        change = np.sqrt(np.mean(np.var(U, axis=1, ddof=1), axis=0))
        floor = np.maximum(floor, np.median(change[lines], axis=0))
    return [int(k) for k in lines if np.all(size[k] <= EXCITED * floor)]
