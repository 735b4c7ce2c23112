# SPDX-License-Identifier: BSD-3-Clause
"""All that a recording says of the frequency response of its system."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.responses.distortions import Distortions, distortions
from jointscope.graphs.responses.local_polynomials import response_without_periods
from jointscope.graphs.responses.resonances import Resonance, resonances
from jointscope.graphs.responses.response_matrix import ResponseMatrix, response_matrix
from jointscope.graphs.responses.spectra import Spectra, spectra
from jointscope.robots.recordings.signals import Excitation, Signals


@dataclass(frozen=True)
class MeasuredResponse:
    """The response of a system.

    Attributes:
        spectra: of its experiments.
        matrix: with covariances.
        distortions: on lines that were not excited; None without whole periods.
        resonances: and anti-resonances.
    """

    spectra: Spectra
    matrix: ResponseMatrix
    distortions: Distortions | None
    resonances: tuple[Resonance, ...]

    @staticmethod
    def of(signals: Signals, excitation: Excitation | None) -> MeasuredResponse:
        """The response that a recording shows.

        Args:
            signals: inputs and outputs.
            excitation: its whole periods; None where there are none.

        Raises:
            RecordingError: it cannot show one.
        """
        if excitation is None:
            found, matrix = response_without_periods(signals)
        else:
            found = spectra(signals, excitation)
            matrix = response_matrix(found)
        peaks = resonances(matrix.frequencies, matrix.G, matrix.sigmas(matrix.total), signals.inputs.step)
        odd = None if excitation is None else distortions(found, matrix)
        return MeasuredResponse(found, matrix, odd, tuple(peaks))

    def _at(self, lines: NDArray[np.bool_]) -> list[float]:
        return list(map(float, self.matrix.frequencies[lines]))

    def to_json(self) -> dict[str, Any]:
        """The content of `--json`."""
        m = self.matrix
        noise = None if m.noise is None else m.relative(m.noise).tolist()
        return {
            "path": self.spectra.path,
            "excitation": {
                "source": self.spectra.excitation.source,
                "f0": self.spectra.excitation.f0,
                "lines": self.spectra.excitation.lines.tolist(),
                "experiments": len(self.spectra.U),
                "whole_periods": self.distortions is not None,
                "periods": m.periods,
                "realisations": len(m.each),
                "pairs": self.spectra.common is not None,
            },
            "inputs": list(m.inputs),
            "outputs": list(m.outputs),
            "noise": noise,
            "total": m.relative(m.total).tolist(),
            "total_from": m.total_from,
            "buried": None if m.buried is None else dict(zip(m.inputs, map(self._at, m.buried.T), strict=True)),
            "resonances": [
                {
                    "input": m.inputs[r.input],
                    "output": m.outputs[r.output],
                    "anti": r.anti,
                    "frequency": {"value": r.frequency, "sigma": r.frequency_sigma, "unit": "Hz"},
                    "damping": {"value": r.damping, "sigma": r.damping_sigma, "unit": "1"},
                }
                for r in self.resonances
            ],
        }
