# SPDX-License-Identifier: BSD-3-Clause
"""Response matrices for other programs: .npz with arrays, .csv with a row for each line and entry."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jointscope.graphs.responses.measured_response import MeasuredResponse


def write_responses(path: Path, found: Sequence[MeasuredResponse], suffix: str) -> None:
    """Writes matrices.

    Args:
        path: where to.
        found: of each bag; in .npz the arrays of the second one on are named BAG.ARRAY.
        suffix: ".npz" or ".csv".
    """
    if suffix == ".csv":
        _write_table(path, found)
        return
    arrays: dict[str, Any] = {}
    for i, one in enumerate(found):
        m, prefix = one.matrix, f"{Path(one.spectra.path).stem}." if i else ""
        own = {"frequency_hz": m.frequencies, "response": m.G, "total_covariance": m.total}
        own |= {} if m.noise is None else {"noise_covariance": m.noise}
        own |= {"inputs": np.array(m.inputs), "outputs": np.array(m.outputs)}
        arrays |= {prefix + name: array for name, array in own.items()}
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)


def _write_table(path: Path, found: Sequence[MeasuredResponse]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["bag", "frequency_hz", "from", "to", "real", "imag", "sigma_noise", "sigma_total"])
        for one in found:
            m = one.matrix
            total = m.sigmas(m.total)
            noise = np.full_like(total, np.nan) if m.noise is None else m.sigmas(m.noise)
            for k, i, j in np.ndindex(m.G.shape):
                g = m.G[k, i, j]
                numbers = (g.real, g.imag, noise[k, i, j], total[k, i, j])
                names = (Path(one.spectra.path).stem, f"{m.frequencies[k]:.9g}", m.inputs[j], m.outputs[i])
                table.writerow([*names, *(f"{x:.9g}" for x in numbers)])
