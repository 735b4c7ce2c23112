# SPDX-License-Identifier: BSD-3-Clause
"""How a number with a sigma shows itself: one line when printed, a small table in a notebook."""

from __future__ import annotations

import math
from html import escape


class ShownValue:
    """One line for `print`, a table for notebooks.

    Attributes:
        name, value, sigma, unit: what is shown; the sigma may be None.
        prior, prior_sigma: what was believed before, in `unit`.
    """

    name: str
    value: float
    sigma: float | None
    unit: str
    prior: float
    prior_sigma: float

    @property
    def remark(self) -> str:
        """What a reader must know besides; empty if nothing."""
        return ""

    def __repr__(self) -> str:
        """One line: "joint1.stiffness = 187.553 ± 0.010 N m/rad, prior 400 ± 600"."""
        return f"{self.name} = {', '.join(self._parts())}"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        first, *others = map(escape, self._parts())
        return f"<b>{escape(self.name)}</b> = {first}{''.join(f'<br>{other}' for other in others)}"

    def _parts(self) -> list[str]:
        """Value, prior, and what must be known, each as text."""
        known = math.isfinite(self.prior) and self.prior_sigma > 0.0  # derived results have none
        prior = f"prior {quantity(self.prior, self.prior_sigma, '1')}" if known else ""
        return [quantity(self.value, self.sigma, self.unit), *filter(None, [prior, self.remark])]


def quantity(value: float, sigma: float | None, unit: str) -> str:
    """A value with its sigma, where there is one, and its unit: "187.553 ± 0.01 N m/rad"."""
    text = f"{value:.6g}"
    if sigma and math.isfinite(sigma):
        last = math.floor(math.log10(sigma)) - 1  # two digits of the sigma
        size = math.floor(math.log10(abs(value))) if value else last
        text = f"{_rounded(value, max(size - last + 1, 3))} ± {_rounded(sigma, 2)}"
    return f"{text} {'' if unit == '1' else unit}".rstrip()


def _rounded(value: float, digits: int) -> str:
    """So many significant digits, and no power of ten where only zeros would follow: 120, not 1.2e+02."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+0" in text else text
