# SPDX-License-Identifier: BSD-3-Clause
"""Short pieces of long recordings, for the first stage of a calibration.

Parameters and noise are found on a few windows that hold all kinds of motion; the whole recording then needs only a
few iterations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.problem.bag_problem import first_command_time
from jointscope.robots.recordings.recording import Recording

WINDOW = 0.8  # [s]
FEWEST_SAMPLES = 10  # of every sensor; a window inside a gap is left out
TOTAL = 6.4  # [s] all windows together


def windows_of(
    recordings: Sequence[Recording], total: float = TOTAL, length: float = WINDOW
) -> list[tuple[int, Recording]]:
    """Windows with the index of their recording; a recording that is short comes whole.

    Windows are spread evenly over the time after the first command.

    Args:
        recordings: all of them.
        total: length of all windows together [s].
        length: of one window [s].
    """
    wanted = total / len(recordings)
    pieces: list[tuple[int, Recording]] = []
    for i, recording in enumerate(recordings):
        start = first_command_time(recording)
        end = float(recording.command.times[-1])
        count = int(np.ceil(wanted / length))
        if end - start <= 1.5 * count * length:
            pieces.append((i, recording))
            continue
        starts = np.linspace(start, end - length, count)
        cut = [recording.between(float(t), float(t) + length) for t in starts]
        full = [
            piece for piece in cut if all(len(s) >= FEWEST_SAMPLES for n, s in piece.streams.items() if n != "command")
        ]
        pieces += [(i, piece) for piece in full or [recording]]
    return pieces
