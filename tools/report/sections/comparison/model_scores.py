# SPDX-License-Identifier: BSD-3-Clause
"""Error against floor of every model, in big numbers and in words."""

from __future__ import annotations

import math
from html import escape

from jointscope.graphs.comparison.comparison_result import ComparisonResult, ModelComparison
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.report.page.page import Section
from jointscope.tools.report.page.scale import log_ticks
from jointscope.tools.report.sections.comparison.model_colours import model_colour

ADEQUATE, DOUBTFUL = 1.1, 2.0  # error over floor
BLIND = 3.0  # [sensor sigma] a floor above this comes from the model's own noise, not from the sensors
BAR = 560  # [px]
LEAST = 0.5  # [sensor sigma] left end of the logarithmic bars


def model_scores(result: ComparisonResult) -> Section:
    """A box with the answer, then one bar per model."""
    best = min(result.models, key=lambda m: m.error, default=None)
    if best is None:
        return Section("scores", "How good are the predictions?", "<p>There is no model to compare.</p>")
    level = _level(best)
    models = "".join(_big(model, i) for i, model in enumerate(result.models))
    body = (
        f'<div class="verdict {level}"><p class="answer">{escape(_answer(best, len(result.models)))}</p>'
        f'<p class="why">{escape(_reason(best))}</p><div class="figures">{models}</div>{_bars(result)}</div>'
        '<p class="quiet" style="margin-top:12px">Error: root mean square over all channels of the error '
        f"{escape(result.models[0].predicted)}, in sigmas of the sensor. Floor: what sensor noise and the uncertainty "
        "of the state alone would give.</p>"
    )
    return Section("scores", "How good are the predictions?", body)


def _level(model: ModelComparison) -> str:
    ratio = model.error / model.floor
    if ratio <= ADEQUATE and model.floor > BLIND:
        return "warn"
    return "good" if ratio <= ADEQUATE else "warn" if ratio <= DOUBTFUL else "bad"


def _answer(best: ModelComparison, count: int) -> str:
    which = "The model" if count == 1 else best.label
    if best.floor > BLIND and best.error / best.floor <= ADEQUATE:
        return f"{which} is as uncertain as it is wrong."
    return {
        "good": f"{which} predicts as well as the sensors allow.",
        "warn": f"{which} predicts well, but misses something.",
        "bad": f"{which} misses something large." if count == 1 else f"Even {which} misses something large.",
    }[_level(best)]


def _reason(best: ModelComparison) -> str:
    ratio = best.error / best.floor
    share = max(1.0 - 1.0 / ratio**2, 0.0)
    text = f"Its error {best.predicted} is {significant(ratio)} times the floor"
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
    """Error as a logarithmic bar, the floor as a mark on it, all models on one scale."""
    largest = 1.15 * max(max(m.error, m.floor, 2.0) for m in result.models)

    def at(value: float) -> float:
        return BAR * max(math.log(max(value, LEAST) / LEAST), 0.01) / math.log(largest / LEAST)

    rows = []
    for i, model in enumerate(result.models):
        y = 26 * i + 6
        rows.append(
            f'<g class="{model_colour(i)}"><rect class="fill" x="0" y="{y}" width="{at(model.error):.1f}" height="14"/>'
            f'<path class="mark ink" stroke-width="2" d="M{at(model.floor):.1f} {y - 4}v22"/></g>'
        )
    height = 26 * len(result.models) + 4
    ticks = "".join(
        f'<path class="grid" d="M{at(v):.1f} 0V{height}"/>'
        f'<text class="x" x="{at(v):.1f}" y="{height + 14}">{label}</text>'
        for v, label in log_ticks(LEAST, largest)
    )
    return (
        f'<svg viewBox="0 0 {BAR + 20} {height + 20}" width="100%" style="max-width:{BAR + 20}px;display:block;'
        f'margin-top:14px" role="img" aria-label="error and floor per model, in sigmas">{ticks}{"".join(rows)}</svg>'
        '<p class="quiet" style="margin:2px 0 0">bar: error, mark: floor, in sigmas of the sensor (logarithmic)</p>'
    )
