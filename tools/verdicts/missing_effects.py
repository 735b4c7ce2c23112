# SPDX-License-Identifier: BSD-3-Clause
"""Whether values would be others with an effect that the model lacks: no residual need show it, a score test does."""

from __future__ import annotations

from pathlib import Path

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.tools.presentation.numbers import significant

MOST_NAMED = 3


def missing_effects(result: CalibrationResult) -> tuple[str, str]:
    """A level of `judgement.LEVELS` and a sentence."""
    if result.robot.free_links:
        return "info", "Without masses nothing tells."
    found = result.found
    asked = [(effect, shares) for effect in result.lacking if (shares := effect.moved(found))]
    if not asked:
        return "good", "None of the catalogue, as far as one step with each can tell."
    first, shares = asked[0]
    worst = max(shares, key=lambda name: abs(first.with_it[name] - found[name].value) / found[name].sigma)
    unit = next(p.unit for p in result.parameters if p.name == worst)
    others = [effect.label for effect, _ in asked[1:MOST_NAMED]]
    alike = f" (or {' or '.join(others)}, which may look alike)" if others else ""
    file = result.start.path.name
    bag = Path(result.bags[0].recording.path).name if result.bags else "BAG"
    return "bad", (
        f"The recording asks for {first.label}, {catalogue()[first.effect].card.title}{alike}: with it {worst} would "
        f"be about {significant(first.with_it[worst])} instead of {significant(found[worst].value)} {unit}. "
        f"Which it is, and whether it predicts better: `jointscope discover {file} {bag} --holdout-share 0.33 "
        f"-o {result.start.path.stem}_better.yaml`."
    )
