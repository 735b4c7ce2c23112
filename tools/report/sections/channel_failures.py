# SPDX-License-Identifier: BSD-3-Clause
"""Which channels the model fails to predict, as bars, with the memory of their residuals."""

from __future__ import annotations

import math
from html import escape

from jointscope.graphs.failure_analysis import ChannelFailure, FailureAnalysis
from jointscope.tools.report.candidate_numbers import p_text
from jointscope.tools.report.numbers import minus, significant
from jointscope.tools.report.page import Section, sentence, table

BAR = 300  # [px]
LEAST = 0.5  # [sensor sigma] left end of the bars
FINE = 1.5  # [sensor sigma] above this a bar is coloured as a failure


def channel_failures(failure: FailureAnalysis, id_: str = "channels") -> Section:
    """Sentences, then one row per channel, worst first."""
    told = "".join(f"<li>{escape(sentence(text))}</li>" for text in failure.sentences)
    worst = max((c.error for c in failure.channels.values()), default=1.0)
    rows = [_row(name, channel, worst) for name, channel in failure.channels.items()]
    head = ["channel", "error 0.1 s ahead [sensor sigma], logarithmic", "one-step autocorrelation", "Ljung-Box p"]
    body = (f'<ul class="steps">{told}</ul>' if told else "") + table(head, rows, [2, 3])
    lead = (
        "Errors of about 1 sigma are the sensor's own noise. Residuals of one-step predictions that remember their "
        "past (autocorrelation away from zero, small p) say that the model misses something, even where they are small."
    )
    return Section(id_, "Where the model fails", body, lead)


def _row(name: str, channel: ChannelFailure, worst: float) -> list[str]:
    top = math.log(1.1 * max(worst, 2.0) / LEAST)
    length = BAR * max(math.log(max(channel.error, LEAST) / LEAST), 0.01) / top
    one = BAR * math.log(1.0 / LEAST) / top
    tone = "bad" if channel.error > 2.0 * FINE else "warn" if channel.error > FINE else "good"
    bar = (
        f'<svg width="{BAR + 80}" height="18" class="{tone} tone"><rect class="fill" x="0" y="3" '
        f'width="{length:.1f}" height="12"/><path class="mark ink" stroke-width="1.6" d="M{one:.1f} 0v18"/>'
        f'<text class="name" x="{length + 8:.1f}" y="9.5">{significant(channel.error)} σ</text></svg>'
    )
    memory = minus(f"{channel.autocorrelation:+.2f}") if math.isfinite(channel.autocorrelation) else "—"
    return [f"<code>{escape(name)}</code>", bar, memory, p_text(channel.whiteness_p)]
