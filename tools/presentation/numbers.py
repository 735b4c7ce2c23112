# SPDX-License-Identifier: BSD-3-Clause
"""Numbers as text, rounded to what they mean: two digits of the sigma decide how many digits the value gets."""

from __future__ import annotations

import math

PREFIXES = {0: "", -3: "m", -6: "µ", -9: "n"}
MOST_DECIMALS = 7  # more zeros than this are hard to count; then powers of ten are written
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
NO_CHANGE = 0.01  # of chi-square


def decimals_of(sigma: float) -> int:
    """Decimals that show two significant digits of sigma (at least none)."""
    if not math.isfinite(sigma) or sigma <= 0.0:
        return 3
    # 0.0996 rounds up to 0.10: the exponent of the rounded number counts, or three digits would appear
    return max(1 - int(f"{sigma:.1e}".split("e")[1]), 0)


def with_sigma(value: float, sigma: float) -> tuple[str, str]:
    """Value and sigma with the same decimals, two significant digits of sigma.

    Args:
        value: the estimate.
        sigma: its standard deviation, same unit.

    Returns:
        Both as text; sigma is "—" where there is none.
    """
    if not math.isfinite(sigma) or sigma <= 0.0:
        return significant(value, 5), "—"
    decimals = decimals_of(sigma)
    if decimals > MOST_DECIMALS:
        exponent = math.floor(math.log10(max(abs(value), sigma)))
        digits = max(exponent - math.floor(math.log10(sigma)) + 1, 0)
        power = f"·10{str(exponent).translate(SUPERSCRIPTS)}"
        return tuple(f"{minus(f'{x / 10.0**exponent:.{digits}f}')}{power}" for x in (value, sigma))  # type: ignore[return-value]
    return minus(f"{value:.{decimals}f}"), f"{sigma:.{decimals}f}"


def significant(value: float, digits: int = 3) -> str:
    """A number with so many significant digits, without needless powers of ten."""
    if value is None or math.isnan(value):
        return "—"
    if math.isinf(value):
        return minus("∞" if value > 0 else "-∞")
    if value == 0.0:
        return "0"
    exponent = int(f"{value:.{digits - 1}e}".split("e")[1])
    if exponent < -4 or exponent > 5:
        mantissa = value / 10.0**exponent
        return minus(f"{mantissa:.{digits - 1}f}·10{str(exponent).translate(SUPERSCRIPTS)}")
    return minus(f"{value:.{max(digits - 1 - exponent, 0)}f}")


def fall_text(fall: float) -> str:
    """By how much chi-square falls; what rounding makes of nothing, or less than a hundredth, is no change."""
    return "no change" if fall < NO_CHANGE else significant(fall, 3)


def percent(share: float) -> str:
    """A share as per cent with two significant digits."""
    return f"{significant(100.0 * share, 2)} %"


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit with prefix so that numbers up to `largest` read well, for example (1e3, "mrad")."""
    if not math.isfinite(largest) or largest <= 0.0 or largest >= 0.1 or unit in ("", "1"):
        return 1.0, unit
    exponent = max(3 * math.floor(math.log10(largest) / 3.0), min(PREFIXES))
    return 10.0**-exponent, ", ".join(PREFIXES[exponent] + each for each in unit.split(", "))


def minus(text: str) -> str:
    """The same text with a real minus sign, and without one before zero."""
    if text.startswith("-") and not text.strip("-0."):
        return text[1:]
    return text.replace("-", "−")
