# SPDX-License-Identifier: BSD-3-Clause
"""The report of a discovery: the waterfall first, then why each effect was added, and what is left over."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

from jointscope.graphs.discovery.diagnosis_words import there_but_small
from jointscope.graphs.discovery.discovery_result import Discovery, DiscoveryStep
from jointscope.tools.presentation.candidate_numbers import share_text
from jointscope.tools.presentation.compared_models import of_discovery
from jointscope.tools.presentation.model_answer import changes, discovery_answer, judged_error, unexplained_share
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.report.page.answer_box import answer_box
from jointscope.tools.report.page.notices import notices
from jointscope.tools.report.page.page import Section, foldable, page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.report.sections.comparison.horizon_curve import horizon_curve
from jointscope.tools.report.sections.comparison.worst_windows import worst_windows
from jointscope.tools.report.sections.diagnosis.channel_failures import channel_failures
from jointscope.tools.report.sections.diagnosis.failure_correlations import failure_correlations
from jointscope.tools.report.sections.diagnosis.found_parameters import found_parameters
from jointscope.tools.report.sections.diagnosis.next_commands import after_discovery
from jointscope.tools.report.sections.diagnosis.noise_levels import noise_levels
from jointscope.tools.report.sections.diagnosis.ranking import ranking
from jointscope.tools.report.sections.diagnosis.regimes import regimes
from jointscope.tools.report.sections.diagnosis.torque_maps import torque_maps
from jointscope.tools.report.sections.diagnosis.torque_over_time import torque_over_time
from jointscope.tools.report.sections.diagnosis.untestable import untestable
from jointscope.tools.report.sections.diagnosis.waterfall import waterfall

BEFORE_AFTER = "Worst windows, before and after"
BEFORE_AFTER_LEAD = (
    "Where and when the base model predicts worst 0.1 s ahead, and what the last model predicts there, on "
    "the same measurements."
)


def discovery_report(result: Discovery) -> str:
    """The whole page as text.

    Args:
        result: what the discovery found.

    Returns:
        HTML without references to anything outside of itself.
    """
    compared = of_discovery(result)
    recordings = [*result.recordings, *([result.heldout] if result.heldout is not None else [])]
    sections = [
        _discovery_verdict(result),
        waterfall(result),
        found_parameters(result),
        replace(worst_windows(compared), title=BEFORE_AFTER, lead=BEFORE_AFTER_LEAD),
        horizon_curve(compared),
        *_first_diagnosis(result),
        *_later_diagnoses(result),
        after_discovery(result),
        notices(recordings),
        provenance(recordings, [step.robot for step in (result.steps[0], result.steps[-1])]),
    ]
    names = ", ".join(Path(recording.path).name for recording in recordings)
    robot = result.steps[0].robot
    return page(f"Discovery of what {robot.name} lacks", f"{names} · {robot.description}", sections)


def _first_diagnosis(result: Discovery) -> list[Section]:
    """Why the first effect was added: everything that was found with the base model."""
    first = next((step.diagnosis for step in result.steps if step.diagnosis is not None), None)
    if first is None:
        return []
    return [
        ranking(first, title="What the base model lacks"),
        channel_failures(first.failure),
        regimes(first.failure),
        failure_correlations(first.failure),
        torque_maps(first.missing, title="The shape of what the base model lacks"),
        torque_over_time(first.missing),
        noise_levels(first),
        untestable(first),
    ]


def _later_diagnoses(result: Discovery) -> list[Section]:
    """What each later model was found to lack, folded."""
    diagnosed = [(k, step) for k, step in enumerate(result.steps) if step.diagnosis is not None][1:]
    if not diagnosed:
        return []
    body = "".join(foldable(f"after step {k}: {step.label}", _later(step, k)) for k, step in diagnosed)
    lead = "The same questions for the later models; the last one shows what is left over."
    return [Section("later", "What was left after each step", body, lead)]


def _later(step: DiscoveryStep, k: int) -> str:
    assert step.diagnosis is not None
    parts = [
        ranking(step.diagnosis, f"ranking{k}"),
        channel_failures(step.diagnosis.failure, f"channels{k}"),
        regimes(step.diagnosis.failure, f"regimes{k}"),
        torque_maps(step.diagnosis.missing, f"maps{k}"),
    ]
    return "".join(f"<h3>{escape(part.title)}</h3>{part.body}" for part in parts)


def _discovery_verdict(result: Discovery) -> Section:
    """Headline, big numbers, what every step means."""
    first, last = result.steps[0], result.steps[-1]
    judged = "held-out recording" if result.held_out else "training recordings"
    before, after = significant(judged_error(first)), significant(judged_error(last))
    arrow = f"{before} → {after}" if len(result.steps) > 1 else after
    figures = [
        (f"{arrow} <small>σ</small>", f"error {result.judged_by} on the {judged}"),
        (f"{significant(last.floor)} <small>σ</small>", "what noise and the uncertainty of the state alone would give"),
        (share_text(unexplained_share(last)), "of the squared error is still unexplained"),
        (str(len(changes(result))), f"effects changed, {len(result.steps)} models calibrated"),
    ]
    told = [step.paragraph for step in result.steps if step.paragraph]
    if last.diagnosis is not None and last.diagnosis.small:
        told.append(there_but_small(last.diagnosis.small))
    told.append(f"Stopped: {result.stop_reason}")
    return answer_box("verdict", "Which effects did the model lack?", discovery_answer(result), figures, told)
