# SPDX-License-Identifier: BSD-3-Clause
"""Models against a recording on one screen: error and floor, rms per channel and horizon, the worst windows."""

from __future__ import annotations

from jointscope.graphs.comparison.comparison_result import ComparisonResult, ModelComparison
from jointscope.graphs.comparison.open_loop import OPEN_LOOP
from jointscope.tools.presentation.numbers import prefixed, significant
from jointscope.tools.terminal.text_table import text_table

SHOWN_WINDOWS = 3


def comparison_text(result: ComparisonResult) -> str:
    """The summary of a comparison for the terminal."""
    recording = result.recording
    parts = [
        f"{recording.path}: {recording.duration:.1f} s, measured against predicted",
        _models(result),
        _channels(result),
        _free_runs(result),
        *(_worst(model) for model in result.models),
        *(moment.sentence(recording) for moment in result.models[-1].isolated),
    ]
    return "\n\n".join(part for part in parts if part)


def unexplained_share(model: ModelComparison) -> float:
    """Share of the squared error that neither sensor noise nor the uncertainty of the state explains, 0 to 1."""
    if not model.error > 0.0:
        return 0.0
    return max(0.0, 1.0 - (model.floor / model.error) ** 2)


def _models(result: ComparisonResult) -> str:
    rows = [
        [m.label, significant(m.error, 4), significant(m.floor, 4), f"{unexplained_share(m):.1%}"]
        for m in result.models
    ]
    table = text_table(["model", "error", "floor", "unexplained"], rows, "<>>>")
    return f"Error {result.models[0].predicted} in sensor sigmas, and the floor that noise alone would give:\n{table}"


def _channels(result: ComparisonResult) -> str:
    """One row per channel and model; the models of a channel stand below each other."""
    first = result.models[0]
    horizons = next(iter(first.channels.values())).horizons if first.channels else {}
    titles = ["open loop" if h == OPEN_LOOP else f"{float(h):g} s" for h in horizons]
    rows: list[list[str]] = []
    for channel, reference in first.channels.items():
        values = [model.channels[channel] for model in result.models]
        factor, unit = prefixed(reference.noise_sigma, reference.unit)
        for k, (model, c) in enumerate(zip(result.models, values, strict=True)):
            start = [channel, significant(factor * c.noise_sigma), unit] if k == 0 else ["", "", ""]
            rms = [significant(factor * c.horizons[h]) for h in horizons]
            rows.append([*start, model.label, *rms, f"{c.fit_percent:.1f} %"])
    head = ["channel", "sigma", "unit", "model", *titles, "fit 0.1 s"]
    return f"Rms error per channel and horizon:\n{text_table(head, rows, '<><<' + '>' * len(titles) + '>')}"


def _free_runs(result: ComparisonResult) -> str:
    """Position-controlled robots: the model with its controller, alone from beginning to end."""
    lines = []
    for model in result.models:
        if model.free_run is not None:
            factor, unit = prefixed(max(model.free_run.mean_abs.values()), model.robot.unit("rad"))
            said = [f"{name} {significant(factor * e)} {unit}" for name, e in model.free_run.mean_abs.items()]
            lines.append(f"  {model.label}: {', '.join(said)}")
    return "\n".join(["Simulated with its position controller, mean absolute error:", *lines]) if lines else ""


def _worst(model: ModelComparison) -> str:
    if not model.worst:
        return ""
    lines = [
        f"  {w.t0:.2f} to {w.t1:.2f} s, {w.channel}: {w.share:.0%} of the squared error"
        for w in model.worst[:SHOWN_WINDOWS]
    ]
    return "\n".join([f"Where {model.label} is worst:", *lines])
