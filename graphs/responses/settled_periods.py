# SPDX-License-Identifier: BSD-3-Clause
"""Leading periods of an experiment that are not steady: the excitation repeats itself, the response does not yet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f

from jointscope.graphs.responses.spectra import steady_spectra
from jointscope.robots.recordings.signals import Excitation, Experiment, Signals

FEWEST = 2  # periods that must be left to compare with
CLEARLY = 4.0  # times the power by which the later periods differ: twice the noise
CHANCE = 1e-4  # of a steady period that differs that much


def settled(signals: Signals, excitation: Excitation) -> Excitation:
    """The excitation with the periods of each experiment marked that its response needs to settle.

    Args:
        signals: inputs and outputs.
        excitation: how they were excited, with all periods that the excitation has.

    Raises:
        RecordingError: an experiment is not in the recording, or its periods are not whole.
    """
    marked = tuple(replace(e, transient=_unsettled(signals, excitation, e)) for e in excitation.experiments)
    return replace(excitation, experiments=marked)


def _unsettled(signals: Signals, excitation: Excitation, experiment: Experiment) -> int:
    """How many periods at the begin differ from all that follow, more than these among each other."""
    alone = replace(excitation, experiments=(replace(experiment, sign=1),))
    Y = steady_spectra(signals.outputs, alone, signals.path)[0][0]
    Y = Y[:, excitation.lines[excitation.lines < Y.shape[1]]]
    count = experiment.transient
    while len(Y) > FEWEST and _differs(Y[0], Y[1:]):
        Y, count = Y[1:], count + 1
    return count


def _differs(first: NDArray[np.complex128], later: NDArray[np.complex128]) -> bool:
    """Whether a period, shape (lines, channels), is none of those that follow, shape (periods, lines, channels)."""
    n = len(later)
    each = np.var(later, axis=0, ddof=1)
    off = np.abs(first - later.mean(axis=0)) ** 2 / (1.0 + 1.0 / n)
    return _differs_in_power(off, each, n) or _differs_line_by_line(off, each, n)


def _differs_in_power(off: NDArray[np.float64], each: NDArray[np.float64], n: int) -> bool:
    """Whether all lines of a channel together differ more than `n` later periods do, shapes (lines, channels)."""
    power = each.sum(axis=0)
    # as many lines count as share the noise
    lines = np.maximum(power**2 / np.maximum(np.sum(each**2, axis=0), 1e-300), 1.0)
    limit = np.maximum(f.isf(CHANCE, 2.0 * lines, 2.0 * lines * (n - 1)), CLEARLY)
    return bool(np.any(off.sum(axis=0) > limit * power))


def _differs_line_by_line(off: NDArray[np.float64], each: NDArray[np.float64], n: int) -> bool:
    """The same where most of a transient is in a few lines, by the ratios of all lines (Fisher's combined test).

    What rings on after a begin is left in the later periods, too, most of it at lines of a resonance: the power tells
    these alone, which are too few to be sure. A drift makes ratios of 3, which is less than `CLEARLY`.
    """
    known = each > 0.0
    ratios = np.divide(off, each, out=np.zeros_like(off), where=known)
    usual = float(f.median(2.0, 2.0 * (n - 1)))
    for ratio in (ratios[known[:, k], k] for k in range(off.shape[1])):
        if len(ratio) and np.median(ratio) > CLEARLY * usual:
            evidence = -2.0 * np.sum(f.logsf(ratio, 2.0, 2.0 * (n - 1)))
            if chi2.sf(evidence, 2.0 * len(ratio)) < CHANCE:
                return True
    return False
