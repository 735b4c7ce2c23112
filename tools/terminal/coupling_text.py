# SPDX-License-Identifier: BSD-3-Clause
"""What recordings with locked springs say of the transmission, for the screen."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.locked_springs.coupling import Coupling
from jointscope.tools.bags.clocks.durations import counted
from jointscope.tools.presentation.numbers import significant, with_sigma
from jointscope.tools.terminal.text_table import text_table


def coupling_text(found: Coupling) -> str:
    """The matrix of the locked springs alone, element by element, and whether it is that of the file."""
    lines = []
    for fit in found.fits:
        for i, readings in enumerate(fit.readings):
            worst = int(np.argmax(fit.rms / fit.explained))
            unit = found.robot.unit_at(readings.joints[worst], "rad")
            lines.append(
                f"Locked springs in {readings.path} ({', '.join(readings.joints)}): {len(readings)} instants; motors "
                f"follow links within {significant(fit.rms[worst], 2)} {unit} (rms, {readings.joints[worst]}), "
                f"encoders explain {significant(fit.explained[worst], 2)} {unit}; link encoders are "
                f"{significant(1e3 * fit.delays[i], 2)} ms late"
            )
    zero = sum(int((~fit.free & ~fit.readings[0].still).sum()) for fit in found.fits)
    head = ["link angle per motor angle", "file", "locked springs", "± sigma"]
    lines += [text_table(head, coupling_rows(found), "<>>>")]
    if zero:
        lines.append(
            f"Nothing else turns a motor: {counted(zero, 'further element')} of the inverse "
            f"{'is' if zero == 1 else 'are'} zero within 4 sigma, and held there."
        )
    wrong = found.sentence()
    lines.append(wrong if wrong else "The transmission of the robot file is the one that the locked springs show.")
    return "\n".join(lines)


def coupling_rows(found: Coupling) -> list[list[str]]:
    """Name, value of the file, value and sigma of each element that was told."""
    rows = []
    for i, j in np.ndindex(found.matrix.shape):
        if found.sigmas[i, j] > 0.0:
            value, sigma = with_sigma(float(found.matrix[i, j]), float(found.sigmas[i, j]))
            rows.append([found.element(i, j), significant(float(found.stated[i, j]), 6), value, sigma])
    return rows
