# SPDX-License-Identifier: BSD-3-Clause
"""What `calibrate --incremental` prints after every stretch: the parameters as far as they are known, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from jointscope.graphs.gtsam_solvers.incremental_solver import KnownSoFar
from jointscope.tools.presentation.numbers import with_sigma
from jointscope.tools.terminal.text_table import text_table

ABREAST = 2  # parameters on a line


def known_so_far_text(known: KnownSoFar, units: Mapping[str, str]) -> str:
    """A headline and a table.

    Args:
        known: after a stretch.
        units: SI unit of each free parameter.
    """
    name = Path(known.recording.path).name
    head = f"after {known.seconds:.1f} s of {name} (stretch {known.stretch} of {known.stretches})"
    calibration = known.calibration
    cells = []
    for parameter, value, sigma in zip(calibration.names, calibration.values, known.sigmas, strict=True):
        number, spread = with_sigma(float(value), float(sigma))
        cells.append([parameter, number, f"± {spread}", units.get(parameter, "")])
    cells += [["", "", "", ""]] * (-len(cells) % ABREAST)
    rows = [[text for cell in cells[i : i + ABREAST] for text in cell] for i in range(0, len(cells), ABREAST)]
    return f"{head}\n{text_table(rows[0], rows[1:], '<><<' * ABREAST)}" if rows else head
