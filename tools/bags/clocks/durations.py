# SPDX-License-Identifier: BSD-3-Clause
"""Times as people say them."""

from __future__ import annotations

MINUTE, HOUR, DAY, YEAR = 60.0, 3600.0, 86400.0, 365.25 * 86400.0  # [s]


def duration(seconds: float) -> str:
    """A span of time in words: "0.38 ms", "3.2 s", "2 h 5 min", "56 years"."""
    size = float(f"{abs(seconds):.3g}") if abs(seconds) < 0.1 else abs(seconds)  # as it is told: 999.6 us are 1 ms
    if size < 1e-6:
        return f"{1e9 * size:.3g} ns"
    if size < 1e-3:
        return f"{1e6 * size:.3g} us"
    if size < 0.1:
        return f"{1e3 * size:.3g} ms"
    if size < 2 * MINUTE:
        return f"{size:.4g} s"
    size = float(round(size))
    if size < 2 * HOUR:
        return f"{size // MINUTE:.0f} min {size % MINUTE:.0f} s"
    if size < 2 * DAY:
        minutes = round(size / MINUTE)
        return f"{minutes // 60} h {minutes % 60} min"
    return f"{size / DAY:.0f} days" if size < 2 * YEAR else f"{size / YEAR:.0f} years"


def counted(count: int, what: str) -> str:
    """A number of things: "1 sample", "3 samples"."""
    return f"{count} {what}{'s' * (count != 1)}"
