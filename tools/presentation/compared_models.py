# SPDX-License-Identifier: BSD-3-Clause
"""Models of a diagnosis or a discovery as a comparison on one recording, for the sections that draw comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from jointscope.graphs.comparison.comparison_result import ComparisonResult, ModelComparison
from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.units import joined


def of_diagnosis(result: Diagnosis) -> ComparisonResult | None:
    """The base model; None where it was not compared."""
    if result.comparison is None:
        return None
    return ComparisonResult(_recording(result.comparison, result.heldout, result.recordings), (result.comparison,))


def of_discovery(result: Discovery) -> ComparisonResult:
    """The first model and, where there are several, the last one."""
    steps = [result.steps[0], *result.steps[-1:]] if len(result.steps) > 1 else result.steps[:1]
    labels = ["base model", "last model"]
    models = [replace(step.comparison, label=label) for step, label in zip(steps, labels, strict=False)]
    return ComparisonResult(_recording(models[0], result.heldout, result.recordings), tuple(models))


def _recording(model: ModelComparison, heldout: Recording | None, training: Sequence[Recording]) -> Recording:
    """The recording that was predicted; what the predictions hold of it where nobody kept it."""
    if heldout is not None or training:
        return heldout or training[0]
    streams = {
        name: Stream(name, sensor.times, sensor.measured, sensor.channels, joined(sensor.units))
        for name, sensor in model.sensors.items()
    }
    return Recording("", "", 0, streams)
