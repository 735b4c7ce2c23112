# SPDX-License-Identifier: BSD-3-Clause
"""Leading periods of an experiment that are not steady: the excitation repeats itself, the response does not yet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

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
    power = each.sum(axis=0)
    off = np.sum(np.abs(first - later.mean(axis=0)) ** 2, axis=0) / (1.0 + 1.0 / n)
    # as many lines count as share the noise
    lines = np.maximum(power**2 / np.maximum(np.sum(each**2, axis=0), 1e-300), 1.0)
    limit = np.maximum(f.isf(CHANCE, 2.0 * lines, 2.0 * lines * (n - 1)), CLEARLY)
    return bool(np.any(off > limit * power))
