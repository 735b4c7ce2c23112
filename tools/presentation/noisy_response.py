# SPDX-License-Identifier: BSD-3-Clause
"""What a frequency response that says little likely suffers from: a sentence, as far as the recording shows it."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.responses.measured_response import MeasuredResponse
from jointscope.robots.recordings.signals import named
from jointscope.tools.presentation.numbers import percent

NOISY = 0.3  # total sigma over the size of an entry, the median over lines: above it a response tells little
TO_THE_END = 0.95  # of half the sampling rate: lines that go up to it may be others, folded
FAITHFUL = 0.5  # of the total: where noise is less, periods repeat what realisations do not


def noise_doubt(found: MeasuredResponse) -> str:
    """Why a response is that noisy; empty where it is not."""
    m = found.matrix
    total = m.relative(m.total)
    i, j = np.unravel_index(int(np.argmax(total)), total.shape)
    if not total[i, j] > NOISY:
        return ""
    said = f"The response from {m.inputs[j]} to {m.outputs[i]} is known to {percent(float(total[i, j]))} only"
    noise = None if m.noise is None else float(m.relative(m.noise)[i, j])
    highest, half_rate = float(m.frequencies[-1]), float(found.spectra.frequencies[-1])
    if found.distortions is not None and highest > TO_THE_END * half_rate:
        return (
            f"{said}, and the lines go up to {highest:.4g} Hz, half the rate of the samples: what was excited above "
            "folds onto other lines, and no response fits both. Record at more than twice the highest excited "
            "frequency, or low-pass before samples are left out."
        )
    if noise is not None and noise < FAITHFUL * float(total[i, j]):
        return (
            f"{said}, though its periods repeat to {percent(noise)}: it depends on the phases of the excitation, as "
            "with friction, backlash, another input that moves along, or frequencies above half the rate that fold."
        )
    return (
        f"{said}: the output changes from period to period. Likely the excitation is small against sensor noise, the "
        "system had not settled, something else moves it, or input and output do not belong together (--from, --to)."
    )


def buried_lines(found: MeasuredResponse) -> str:
    """At which lines an input is buried in noise; empty where none is."""
    m = found.matrix
    if m.buried is None or not np.any(m.buried):
        return ""
    parts = [
        f"{name} at {named([f'{f:g}' for f in m.frequencies[lines]])} Hz"
        for name, lines in zip(m.inputs, m.buried.T, strict=True)
        if np.any(lines)
    ]
    return (
        f"Inputs that hardly rise above their noise: {'; '.join(parts)}. The response from them is too small there, "
        "or in a closed loop the inverse of the controller, by more than sigmas can tell: excite more, leave these "
        "lines out of the excitation, or name fewer inputs with --from."
    )
