# SPDX-License-Identifier: BSD-3-Clause
"""Which channels the model fails to predict, as bars, with the memory of their residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from jointscope.graphs.comparison.failure_analysis import ChannelFailure, FailureAnalysis
from jointscope.tools.presentation.candidate_numbers import p_text
from jointscope.tools.presentation.numbers import minus, percent, significant
from jointscope.tools.report.page.page import Section, foldable, listed, sentence, table

SHOWN = 3  # sentences; more fold
BAR = 280  # [px]
LEAST = 0.5  # [sensor sigma] left end of the bars
FINE = 1.5  # error over floor; above this a bar is coloured as a failure


def channel_failures(failure: FailureAnalysis, id_: str = "channels") -> Section:
    """Sentences, then one row per channel, worst first."""
    told = _list(failure.sentences[:SHOWN])
    if failure.sentences[SHOWN:]:
        told += foldable(f"{len(failure.sentences) - SHOWN} more channels in words", _list(failure.sentences[SHOWN:]))
    worst = max((c.error for c in failure.channels.values()), default=1.0)
    rows = [_row(name, channel, worst) for name, channel in failure.channels.items()]
    head = [
        "channel",
        "error 0.1 s ahead [sensor sigma], logarithmic",
        "worst half second, share of its error",
        "one-step autocorrelation",
        "Ljung-Box p",
    ]
    body = told + table(head, rows, [3, 4])
    lead = (
        "Mark: the channel's floor, what sensor noise and the uncertainty of the state alone would leave. Residuals of "
        "one-step predictions that remember their past (autocorrelation away from zero, small p) say that the model "
        "misses something, even where they are small."
    )
    return Section(id_, "Where the model fails", body, lead)


def _list(sentences: Sequence[str]) -> str:
    return listed((escape(sentence(text)) for text in sentences), "steps") if sentences else ""


def _row(name: str, channel: ChannelFailure, worst: float) -> list[str]:
    top = math.log(1.1 * max(worst, 2.0) / LEAST)
    length = BAR * max(math.log(max(channel.error, LEAST) / LEAST), 0.01) / top
    floor = BAR * max(math.log(max(channel.floor, LEAST) / LEAST), 0.0) / top
    ratio = channel.error / max(channel.floor, LEAST)
    tone = "bad" if ratio > 2.0 * FINE else "warn" if ratio > FINE else "good"
    bar = (
        f'<svg width="{BAR + 80}" height="18" class="{tone} tone"><rect class="fill" x="0" y="3" '
        f'width="{length:.1f}" height="12"/><path class="mark ink" stroke-width="1.6" d="M{floor:.1f} 0v18"/>'
        f'<text class="name" x="{max(length, floor) + 8:.1f}" y="9.5">{significant(channel.error)} σ</text></svg>'
    )
    memory = minus(f"{channel.autocorrelation:+.2f}") if math.isfinite(channel.autocorrelation) else "—"
    where = [f"{w.t0:.1f} to {w.t1:.1f} s, {percent(w.share)}" for w in channel.windows[:1]]
    return [f"<code>{escape(name)}</code>", bar, *(where or ["—"]), memory, p_text(channel.whiteness_p)]
