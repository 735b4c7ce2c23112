# SPDX-License-Identifier: BSD-3-Clause
"""All candidates with their evidence: score, probability, what a refit explains, size, look-alikes, verdict and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from jointscope.graphs.discovery.diagnosis_result import Candidate, Diagnosis
from jointscope.tools.presentation.candidate_numbers import (
    VERDICT_LEVELS,
    origin_text,
    p_text,
    parameter_texts,
    share_text,
)
from jointscope.tools.presentation.model_answer import enumerated
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.page import Section, foldable, listed, sentence

SHOWN = 10
BAR = 60  # [px]
HEAD = ("", "effect", "verdict", "score", "p", "explains", "error [σ]", "size")
NUMBERS = (3, 4, 6)


def ranking(result: Diagnosis, id_: str = "ranking", title: str = "What may be missing") -> Section:
    """The ranking table; the tail folds."""
    lead = (
        "Score: s' S⁻¹ s where the effect is zero, chi-square with as many degrees of freedom (dof) as it has sizes if "
        "the noise were white. p is robust against coloured noise and corrected for the number of candidates. A long "
        "recording makes everything significant, so a verdict also needs size: explains is the part of the excess "
        "squared error, on blocks that the refit leaves out, that it removes."
    )
    if not result.candidates:
        return Section(id_, title, "<p>No effect of the catalogue can act on this robot.</p>", lead)
    rows = [_row(k + 1, c) for k, c in enumerate(result.candidates)]
    last = max([k for k, c in enumerate(result.candidates) if c.verdict in ("missing", "possible")], default=0)
    cut = max(SHOWN, last + 1)
    body = _table(rows[:cut])
    if rows[cut:]:
        body += foldable(f"{len(rows) - cut} more candidates", _table(rows[cut:]))
    body += (
        '<p class="quiet">On these blocks the base model, which was fitted to them, too, has '
        f"{significant(result.validation_error)} σ. Regressors that mean nothing reach a score of "
        f"{significant(result.placebo_score)} per degree of freedom: a score near that is no evidence.</p>"
    )
    return Section(id_, title, body, lead)


def _table(rows: Sequence[Sequence[str]]) -> str:
    def cell(tag: str, i: int, text: str) -> str:
        return f'<{tag} class="n">{text}</{tag}>' if i in NUMBERS else f"<{tag}>{text}</{tag}>"

    top = "".join(cell("th", i, escape(h)) for i, h in enumerate(HEAD))
    body = "".join("<tr>" + "".join(cell("td", i, c) for i, c in enumerate(row)) + "</tr>" for row in rows)
    return (
        f'<div class="scroll"><table class="ranking"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'
    )


def _row(rank: int, c: Candidate) -> list[str]:
    return [
        str(rank),
        f"<code>{escape(c.label)}</code>{_alike(c)}{_why(c)}",
        badge(c),
        f'{significant(c.score)}<br><small class="quiet">{c.dof} dof</small>',
        p_text(c.p_value),
        _explains(c),
        _errors(c),
        _size(c),
    ]


def badge(c: Candidate) -> str:
    """The verdict as a coloured tag."""
    level = VERDICT_LEVELS.get(c.verdict, "info") if c.verdict != "absent" else ""
    numerics = '<br><small class="quiet">numerics, not physics</small>' if c.numerics else ""
    return f'<span class="badge {level}">{escape(c.verdict)}</span>{numerics}'


def _alike(c: Candidate) -> str:
    if not c.look_alikes:
        return ""
    return f'<br><small class="quiet">looks like {escape(enumerated(c.look_alikes, "or"))}</small>'


def _why(c: Candidate) -> str:
    if not c.reasons:
        return ""
    reasons = listed(escape(sentence(text)) for text in c.reasons)
    opened = " open" if c.verdict == "missing" else ""
    return f"<details{opened}><summary>why</summary>{reasons}</details>"


def _explains(c: Candidate) -> str:
    if not math.isfinite(c.share):
        return '<span class="quiet">not refitted</span>'
    length = BAR * min(max(c.share, 0.0), 1.0)
    return (
        f'<svg width="{BAR + 56}" height="16"><rect class="faint m2" x="0" y="4" width="{BAR}" height="8"/>'
        f'<rect class="fill m2" x="0" y="4" width="{length:.1f}" height="8"/>'
        f'<text class="name" x="{BAR + 6}" y="8.5">{share_text(c.share)}</text></svg>'
    )


def _errors(c: Candidate) -> str:
    """After the refit: on blocks that it left out, and on the held-out recording."""
    lines = [f"{significant(c.validation_error)} blocks"] if math.isfinite(c.validation_error) else []
    lines += [f"{significant(c.heldout_error)} held out"] if math.isfinite(c.heldout_error) else []
    return "<br>".join(lines) or "—"


def _size(c: Candidate) -> str:
    lines = [f"{escape(name)} = {value} ± {sigma} {escape(unit)}" for name, value, sigma, unit in parameter_texts(c)]
    origin = [origin_text(c)] if lines else []
    origin += [f"ΔBIC {significant(c.bic)}"] if math.isfinite(c.bic) else []
    small = [f'<small class="quiet">{", ".join(origin)}</small>'] if origin else []
    return "<br>".join([*(lines or ["—"]), *small])
