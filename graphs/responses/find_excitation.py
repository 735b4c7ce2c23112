# SPDX-License-Identifier: BSD-3-Clause
"""How a recording was excited, found from the signal that drives it: period, lines, experiments, pairs of signs.

The period is the shortest time after which the signal comes again as exactly as it ever does. Experiments are the
stretches in which it does so; what is left at their ends is another signal, or a transient.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from jointscope.graphs.responses.spectra import weak_lines
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.signals import Excitation, Experiment, Signal

Array = NDArray[np.float64]
LIKE = 0.25  # correlation after a lag that may be a period
CANDIDATES = 20  # of such lags
MOST = 0.5  # of the recording must repeat itself
GAP = 1.5  # steps without a sample end a stretch
COMES_AGAIN = 0.1  # of the variance: what a signal may be off after a period
AS_GOOD = 3.0  # times the best lag's difference that another lag may have
EXACTLY = 1e-6  # of the variance: rounding
NEARLY = 0.25  # of a period that may be spoilt at the ends of an experiment
WINDOWS = 16  # of a period, in which is asked whether it comes again
OPPOSITE = 0.2  # of an experiment's size: what a pair may leave in its sum
APART = 10.0  # between lines that are excited and those that are not
LEAST = 16  # samples of a period


class NoPeriodsError(RecordingError):
    """A recording that does not repeat itself for two whole periods."""


def find_excitation(drive: Signal, inputs: int, path: str) -> Excitation:
    """The excitation of a recording.

    Args:
        drive: the signal that was made, a command where there is one, else the input.
        inputs: how many inputs there are: so many experiments make a realisation.
        path: of the recording.

    Raises:
        NoPeriodsError: it never repeats itself.
        RecordingError: it never changes, or nothing stands out.
    """
    edges = np.flatnonzero(np.diff(drive.times) > GAP * drive.step) + 1
    stretches = np.split(np.arange(len(drive.times)), edges)
    size = drive.values.std(axis=0)
    if not np.any(size > 0.0):
        raise RecordingError(f"{path}: {', '.join(drive.names)} never changes; name what was excited with --from")
    u = drive.values[:, size > 0.0] / size[size > 0.0]
    u = u - u.mean(axis=0)
    N = _period([u[s] for s in stretches], path)
    found = [(s[a], count) for s in stretches for a, count in _repeats(u[s], N)]
    if not found:
        raise NoPeriodsError(_no_periods(path))
    each = [np.fft.rfft(u[a : a + count * N].reshape(count, N, -1), axis=1) for a, count in found]
    spectra = np.array([periods.mean(axis=0) for periods in each])
    lines = _lines(spectra)
    fewest = min(count for _, count in found)
    weak = weak_lines(np.array([periods[:fewest] for periods in each]), lines)
    if len(weak) < 0.5 * len(lines):  # of a measured signal some may be noise of the sensor
        lines = np.setdiff1d(lines, weak)
    labels = _labels(spectra[:, lines], inputs)
    experiments = tuple(
        Experiment(*label, start=float(drive.times[a]), periods=count)
        for label, (a, count) in zip(labels, found, strict=True)
    )
    return Excitation(float(f"{1.0 / (N * drive.step):.12g}"), lines, experiments)


def _no_periods(path: str) -> str:
    return (
        f"{path}: the excitation does not repeat itself for two whole periods; record two or more, or say what it was "
        "in excitation.yaml (docs/frequency.md)"
    )


def _period(stretches: Sequence[Array], path: str) -> int:
    """Samples of a period: the shortest lag after which most of the signal comes again as well as it ever does."""
    longest = max(map(len, stretches))
    product, energy = np.zeros(longest), np.zeros(longest)
    for u in stretches:
        n = len(u)
        lags, F = np.arange(n), np.fft.rfft(u, 2 * n, axis=0)
        squares = np.concatenate([[0.0], np.cumsum(np.sum(u**2, axis=1))])
        product[:n] += np.fft.irfft(np.abs(F) ** 2, 2 * n, axis=0)[:n].sum(axis=1)
        energy[:n] += squares[n - lags] + squares[n] - squares[lags]
    alike = 2.0 * product / np.maximum(energy, 1e-9 * energy[0])
    peaks, shape = find_peaks(alike[: longest // 2 + LEAST], height=LIKE)
    best = peaks[np.argsort(-shape["peak_heights"], kind="stable")][:CANDIDATES]
    total, found = sum(map(len, stretches)), []
    for N in np.sort(best[best >= LEAST]).tolist():
        covered = sum(count * N for u in stretches for _, count in _repeats(u, N))
        if covered > MOST * total:
            off = np.concatenate([_off(u, N)[0] for u in stretches if len(u) > N])
            found.append((N, float(np.median(off))))
    if not found:
        raise NoPeriodsError(_no_periods(path))
    least = min(off for _, off in found)
    return next(N for N, off in found if off <= AS_GOOD * least + EXACTLY)


def _off(u: Array, N: int) -> tuple[Array, int]:
    """Squared change after a lag over the size, window by window, and the width of a window."""
    width = max(N // WINDOWS, 1)
    count = (len(u) - N) // width
    off = np.sum((u[N:] - u[:-N]) ** 2, axis=1)[: count * width].reshape(count, width).sum(axis=1)
    level = np.sum(u[: count * width] ** 2, axis=1).reshape(count, width).sum(axis=1)
    return off / (2.0 * np.maximum(level, max(float(np.median(level)), 1e-300) if count else 1.0)), width


def _repeats(u: Array, N: int) -> list[tuple[int, int]]:
    """First sample and number of periods of each part of a stretch that repeats itself."""
    if len(u) < 2 * N - N // WINDOWS:
        return []
    off, width = _off(u, N)
    edges = np.flatnonzero(np.diff((off < COMES_AGAIN).astype(np.int8), prepend=0, append=0)).reshape(-1, 2) * width
    found = []
    for a, b in edges:
        periods = int((b - a) / N + NEARLY) + 1
        if periods > 1:
            middle = (a + b + N) // 2  # windows at both ends hold a part of something else
            start = min(max(middle - periods * N // 2, 0), max(len(u) - periods * N, 0))
            periods = min(periods, len(u) // N)
            found.append((_exactly(u, N, int(start), periods, width), periods))
    return found


def _exactly(u: Array, N: int, start: int, periods: int, width: int) -> int:
    """The first sample near `start` from which the periods are the most alike: a window sees not what begins in it.

    Three samples of the next experiment in 1000 are an error of 5 % at every line.
    """
    change = np.concatenate([[0.0], np.cumsum(np.sum((u[N:] - u[:-N]) ** 2, axis=1))])
    starts = np.arange(max(start - width, 0), min(start + width, len(u) - periods * N) + 1)
    left = change[starts + (periods - 1) * N] - change[starts]
    same = left <= np.min(left) + EXACTLY * float(np.mean(np.sum(u**2, axis=1)))
    return int(starts[same][np.argmin(np.abs(starts[same] - start))])


def _lines(spectra: NDArray[Any]) -> NDArray[np.intp]:
    """Lines that stand out, or, where none are between them, all that are as large as usual."""
    size = np.sqrt(np.mean(np.abs(spectra) ** 2, axis=(0, 2)))
    size[0] = 0.0
    logs = np.log(np.maximum(size[1:], 1e-12 * size.max()))
    order = np.sort(logs)
    n = np.arange(1, len(order))
    low, high = np.cumsum(order)[:-1] / n, (order.sum() - np.cumsum(order)[:-1]) / n[::-1]
    between = n * n[::-1] * (high - low) ** 2  # Otsu's threshold
    at = int(np.argmax(between))
    if high[at] - low[at] > np.log(APART):
        return np.asarray(np.flatnonzero(logs > (high[at] + low[at]) / 2) + 1, dtype=np.intp)
    return np.asarray(np.arange(1, len(size) - 1), dtype=np.intp)


def _labels(spectra: NDArray[Any], inputs: int) -> list[tuple[int, int, int]]:
    """Realisation, number and sign of each experiment; pairs stand behind each other."""
    signs: list[int] = []
    groups: list[int] = []
    for i, U in enumerate(spectra):
        before = spectra[i - 1] if i and signs[-1] == 1 else None
        pair = before is not None and np.linalg.norm(U + before) < OPPOSITE * np.linalg.norm(U)
        signs.append(-1 if pair else 1)
        groups.append(groups[-1] if pair else (groups[-1] + 1 if groups else 0))
    return [(g // inputs, g % inputs, s) for g, s in zip(groups, signs, strict=True)]
