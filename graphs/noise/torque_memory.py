# SPDX-License-Identifier: BSD-3-Clause
"""Do random torques last, and how long? The memory with the largest likelihood, if white noise is clearly less likely.

Parameters stay as white noise has them; that they are a little off costs all memories about the same. A memory is
looked for by factors of two to three, from the middle up and down, on a few windows: what it decides are sigmas, not
values.
"""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.noise.lasting_noise import LastingNoise, NoiseWindows
from jointscope.graphs.problem.windows import windows_of
from jointscope.robots.recordings.recording import Recording

MEMORIES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # [s]
FIRST = 2  # of them is tried first
CYCLES = 5  # updates of the densities for each memory after the first; those of the first lead to them
TOTAL = 3.2  # [s] of all windows
NET = 12.0  # gain in the logarithm of the likelihood beyond the number of densities that came in


def memory_windows(recordings: Sequence[Recording]) -> list[tuple[int, Recording]]:
    """The windows on which a memory is looked for, with the index of their recording."""
    return windows_of(recordings, TOTAL)


def likeliest_memory(windows: NoiseWindows) -> LastingNoise | None:
    """White noise beside torques of the likeliest memory; None where white noise alone is as likely.

    Raises:
        SolveError: states are not determined.
    """
    place, best = FIRST, windows.separated(MEMORIES[FIRST], widen=False)
    if best.evidence - windows.white_evidence() < NET + best.robot.noise.n_lasting + 1:
        return None  # torques of any other memory would make this one likelier than none, too
    for step in (1, -1):
        while 0 <= place + step < len(MEMORIES):
            near = best.robot.noise
            other = windows.separated(MEMORIES[place + step], CYCLES, widen=False, near=near)
            if other.evidence <= best.evidence:
                break
            place, best = place + step, other
        if place != FIRST:
            break
    return best
