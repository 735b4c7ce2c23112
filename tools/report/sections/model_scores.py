# SPDX-License-Identifier: BSD-3-Clause
"""Error against floor of every model, in big numbers and in words."""

from __future__ import annotations

from html import escape

from jointscope.graphs.comparison_result import ComparisonResult, ModelComparison
from jointscope.tools.report.numbers import percent, significant
from jointscope.tools.report.page import Section
from jointscope.tools.report.sections.model_colours import model_colour

ADEQUATE, DOUBTFUL = 1.1, 2.0  # error over floor
BAR = 560  # [px]


def model_scores(result: ComparisonResult) -> Section:
    """A box with the answer, then one bar per model."""
    best = min(result.models, key=lambda m: m.error / m.floor, default=None)
    if best is None:
        return Section("scores", "How good are the predictions?", "<p>There is no model to compare.</p>")
    level = _level(best)
    models = "".join(_big(model, i) for i, model in enumerate(result.models))
    body = (
        f'<div class="verdict {level}"><p class="answer">{escape(_answer(best, len(result.models)))}</p>'
        f'<p class="why">{escape(_reason(best))}</p><div class="figures">{models}</div>{_bars(result)}</div>'
        '<p class="quiet" style="margin-top:12px">Error: root mean square over all channels of the 0.1 s ahead error, in '
        "sigmas of the sensor. Floor: what sensor noise and the uncertainty of the state alone would give.</p>"
    )
    return Section("scores", "How good are the predictions?", body)


def _level(model: ModelComparison) -> str:
    ratio = model.error / model.floor
    return "good" if ratio <= ADEQUATE else "warn" if ratio <= DOUBTFUL else "bad"


def _answer(best: ModelComparison, count: int) -> str:
    which = "The model" if count == 1 else best.label
    return {
        "good": f"{which} predicts as well as the sensors allow.",
        "warn": f"{which} predicts well, but misses something.",
        "bad": f"{which} misses something large." if count == 1 else f"Even {which} misses something large.",
    }[_level(best)]


def _reason(best: ModelComparison) -> str:
    ratio = best.error / best.floor
    share = max(1.0 - 1.0 / ratio**2, 0.0)
    text = f"0.1 s ahead its error is {significant(ratio)} times the floor"
    if share > 0.01:
        text += f"; {percent(share)} of the squared error is not explained by noise"
    if best.worst and share > 0.05:
        w = best.worst[0]
        text += f", most of all in {w.channel} between {w.t0:.2f} and {w.t1:.2f} s"
    return text + "."


def _big(model: ModelComparison, index: int) -> str:
    return (
        f'<div class="{model_colour(index)}"><b>{significant(model.error)} <small>σ, floor {significant(model.floor)}'
        f'</small></b><span><i class="swatch coloured"></i>{escape(model.label)}</span></div>'
    )


def _bars(result: ComparisonResult) -> str:
    """Error as a bar, the floor as a mark on it, all models on one scale."""
    largest = max(max(m.error, m.floor) for m in result.models) or 1.0
    rows = []
    for i, model in enumerate(result.models):
        y, length, floor = 26 * i + 4, BAR * model.error / largest, BAR * model.floor / largest
        rows.append(
            f'<g class="{model_colour(i)}"><rect class="fill" x="0" y="{y}" width="{length:.1f}" height="14"/>'
            f'<path class="mark ink" stroke-width="2" d="M{floor:.1f} {y - 4}v22"/></g>'
        )
    height = 26 * len(result.models) + 20
    label = f'<text x="{min(BAR * result.models[-1].floor / largest, BAR - 30):.1f}" y="{height - 4}">floor</text>'
    return (
        f'<svg viewBox="0 0 {BAR + 4} {height}" width="100%" style="max-width:{BAR}px;display:block;margin-top:14px" '
        f'role="img" aria-label="error and floor per model">{"".join(rows)}{label}</svg>'
    )
