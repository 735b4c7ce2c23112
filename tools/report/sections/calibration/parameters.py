# SPDX-License-Identifier: BSD-3-Clause
"""Table of the dynamic parameters: from where to where, how certain, and what the literature says."""

from __future__ import annotations

import math
from html import escape

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.robots.parts.relative_sigma import KNOWN
from jointscope.tools.presentation.numbers import percent, significant, with_sigma
from jointscope.tools.report.page.page import Section, table
from jointscope.tools.verdicts.priors.held_values import is_held, is_mounting_or_bias

BAR = 84  # [px]
LADDER = 150  # [px]


def parameters(result: CalibrationResult) -> Section:
    """The dynamic parameters; mounting and biases have their own section."""
    rows = [p for p in result.parameters if not is_mounting_or_bias(p)]
    published = any(p.published is not None for p in rows)
    noted = any(_note(p) for p in rows)
    head = ["parameter", "unit", "start", "value", "± sigma", "relative sigma", "where it lies", "prior"]
    head += [_source(result)] if published else []
    head += ["note"] if noted else []
    numbers = [2, 3, 4, 7, 8] if published else [2, 3, 4, 7]
    cells = [_row(p, published, noted) for p in rows]
    legend = (
        '<p class="quiet">Where it lies: <b>●</b> value with ±2 sigma, ○ start'
        + (", ◇ published" if published else "")
        + ", shaded: prior ±1 sigma, each on its own scale. "
        "Bars of the relative sigma are logarithmic from 0.01 % to 100 %.</p>"
    )
    lead = "What was calibrated. Sigmas are one standard deviation and include the uncertainty of everything else."
    return Section("parameters", "Parameters", table(head, cells, numbers) + legend, lead)


def _source(result: CalibrationResult) -> str:
    return "Table 1" if result.robot.name.startswith("doggy") else "published"


def _row(p: ParameterEstimate, published: bool, noted: bool) -> list[str]:
    value, sigma = with_sigma(p.value, p.sigma)
    share = p.sigma / abs(p.value) if p.value else math.inf
    row = [
        f"<code>{escape(p.name)}</code>",
        f'<span class="nowrap">{escape(p.unit)}</span>',
        significant(p.start, 4),
        f"<b>{value}</b>",
        sigma,
        _share_bar(share),
        _ladder(p),
        f"{significant(p.prior)} ± {significant(p.prior_sigma, 2)}",
    ]
    if published:
        row.append("—" if p.published is None else significant(p.published, 5))
    if noted:
        row.append(_note(p))
    return row


def _note(p: ParameterEstimate) -> str:
    text = p.note or ("held by its prior" if is_held(p) else "")
    return f'<span class="tag warn">{escape(text)}</span>' if text else ""


def _share_bar(share: float) -> str:
    """A logarithmic bar from 0.01 % to 100 % and the number."""
    if not math.isfinite(share):
        return "—"
    length = BAR * min(max((math.log10(max(share, 1e-6)) + 4.0) / 4.0, 0.02), 1.0)
    tone = "good" if share < 0.02 else "warn" if share < 0.2 else "bad"
    return (
        f'<svg width="{BAR + 70}" height="16" class="{tone} tone">'
        f'<rect class="faint" x="0" y="4" width="{BAR}" height="8"/>'
        f'<rect class="fill" x="0" y="4" width="{length:.1f}" height="8"/>'
        f'<text class="name" x="{BAR + 6}" y="8.5">{percent(share) if share <= KNOWN else "&gt; 100 %"}</text></svg>'
    )


def _ladder(p: ParameterEstimate) -> str:
    """Start, value with 2 sigma, prior and published value on one line."""
    points = [p.start, p.value - 2 * p.sigma, p.value + 2 * p.sigma]
    points += [] if p.published is None else [p.published]
    low, high = min(points), max(points)
    air = 0.12 * (high - low) or abs(p.value) or 1.0
    low, high = low - air, high + air

    def at(x: float) -> float:
        return 5 + (LADDER - 10) * min(max((x - low) / (high - low), 0.0), 1.0)

    prior = [at(p.prior - p.prior_sigma), at(p.prior + p.prior_sigma)]
    a, b = at(p.value - 2 * p.sigma), at(p.value + 2 * p.sigma)
    diamond = ""
    if p.published is not None:
        d = at(p.published)
        diamond = f'<path class="mark k3" stroke-width="1.6" d="M{d:.1f} 3.5l4.5 4.5l-4.5 4.5l-4.5-4.5z"/>'
    return (
        f'<svg width="{LADDER}" height="16"><rect class="faint soft" x="{prior[0]:.1f}" y="3" '
        f'width="{max(prior[1] - prior[0], 0.5):.1f}" height="10"/>'
        f'<path class="grid" d="M0 8H{LADDER}"/>'
        f'<circle class="mark soft" stroke-width="1.4" cx="{at(p.start):.1f}" cy="8" r="3.6"/>'
        f'<path class="mark ink" stroke-width="2.4" d="M{a:.1f} 8H{b:.1f}"/>'
        f'<circle class="fill ink" cx="{at(p.value):.1f}" cy="8" r="3.4"/>{diamond}</svg>'
    )
