# SPDX-License-Identifier: BSD-3-Clause
"""Whether a stamp can belong to the present run: a wild stamp is left out, a clock that was set is followed.

The clock of the encoders is the clock. One message with an impossible stamp is an error; several encoder samples in a
row whose stamps fit each other, but not the estimate, mean that the clock was set or that nothing came for long.
"""

from __future__ import annotations

AHEAD = 0.3  # [s] further ahead of the estimate than this no stamp belongs to it
BELIEVED = 5  # encoder samples in a row that fit each other


class ClockWatch:
    """Compares stamps with the time of the estimate.

    Args:
        encoder: name of the encoders' stream.
        lag: length of the estimator's window [s].

    Attributes:
        was_set: whether the encoders now live at another time than the estimate.
    """

    def __init__(self, encoder: str, lag: float):
        self._encoder, self._behind = encoder, lag + AHEAD
        self._elsewhere, self._last = 0, 0.0
        self.was_set = False

    def misplaces(self, name: str, t: float, now: float) -> str | None:
        """Why a message cannot be used ("too_late", "too_early"); None if its stamp t is possible at a time now [s]."""
        here = -self._behind <= t - now <= AHEAD
        if name == self._encoder:
            if here:
                self._elsewhere = 0
            else:
                near = self._elsewhere > 0 and abs(t - self._last) <= AHEAD
                self._elsewhere, self._last = self._elsewhere + 1 if near else 1, t
                self.was_set = self._elsewhere >= BELIEVED
        if here:
            return None
        return "too_late" if t < now else "too_early"

    def follow(self) -> None:
        """The estimate goes to the encoders' time."""
        self._elsewhere, self.was_set = 0, False
