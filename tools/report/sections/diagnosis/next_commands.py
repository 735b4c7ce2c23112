# SPDX-License-Identifier: BSD-3-Clause
"""What to type next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from html import escape
from pathlib import Path

from jointscope.graphs.discovery.diagnosis_result import Diagnosis
from jointscope.graphs.discovery.discovery_result import Discovery
from jointscope.robots.model.command_words import edited_argument, edited_path, robot_argument
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.presentation.left_out import recording_arguments
from jointscope.tools.presentation.model_answer import missing_numerics, of_verdict
from jointscope.tools.report.page.page import Section


def after_diagnosis(result: Diagnosis) -> Section:
    """Add the missing effect and calibrate, or let discover do it; or use the model."""
    robot, bags, held = robot_argument(result.robot), recording_arguments(result.recordings), _holdout(result.heldout)
    calibrated = edited_argument(result.robot, "calibrated")
    missing = of_verdict(result, "missing") or missing_numerics(result)
    found = [c.label for c in missing or of_verdict(result, "possible")]
    if result.adequate:
        adequate = "The model is adequate: calibrate with all recordings and use it."
        return _section([(adequate, [_calibrate(robot, bags, calibrated)])])
    blocks = []
    if found:
        effect, added = _quoted(found[0]), edited_argument(result.robot, found[0].partition("@")[0])
        commands = [f"jointscope add {robot} {effect} -o {added}", _calibrate(added, bags, calibrated)]
        if result.heldout is not None:
            commands.append(f"jointscope compare {robot} {calibrated} {recording_arguments([result.heldout])}")
        blocks.append(("Add the first effect, calibrate, and see whether the error falls:", commands))
    better = edited_argument(result.robot, "better")
    discover = f"jointscope discover {robot} {bags}{held} -o {better} --report discovery.html"
    blocks.append(("Or add effects one by one, as long as the error falls:", [discover]))
    return _section(blocks)


def after_discovery(result: Discovery) -> Section:
    """Look at the model that was found, and undo its last step."""
    file = _quoted(result.robot_file or "found.yaml")
    bag = recording_arguments([result.heldout]) if result.heldout is not None else "ANOTHER_BAG"
    first = _quoted(result.steps[0].robot_file) if result.steps[0].robot_file else robot_argument(result.steps[0].robot)
    blocks = [("Compare the first and the last model on any recording:", [f"jointscope compare {first} {file} {bag}"])]
    last = result.steps[-1].added
    if last and last in {here.label for here in result.robot.effects}:  # a better integrator is no effect
        without = edited_path(Path(result.robot_file or "found.yaml"), "without")
        blocks.append(("Take the last effect out again:", [f"jointscope remove {file} {_quoted(last)} -o {without}"]))
    if not result.adequate:
        blocks.append(
            ("See what is still missing:", [f"jointscope diagnose {file} {recording_arguments(result.recordings)}"])
        )
    return _section(blocks)


def _section(blocks: Sequence[tuple[str, Sequence[str]]]) -> Section:
    body = "".join(f"<p>{escape(text)}</p><pre>{escape(chr(10).join(commands))}</pre>" for text, commands in blocks)
    return Section("next", "What to do next", body)


def _calibrate(robot: str, bags: str, output: str) -> str:
    return f"jointscope calibrate {robot} {bags} -o {output}"


def _holdout(recording: Recording | None) -> str:
    return f" --holdout {recording_arguments([recording])}" if recording is not None else ""


def _quoted(text: str) -> str:
    return shlex.quote(text)
