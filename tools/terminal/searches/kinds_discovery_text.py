# SPDX-License-Identifier: BSD-3-Clause
"""How one model grew by recordings of several kinds: its steps, which kind shows what came in, and what is left."""

from __future__ import annotations

from jointscope.graphs.across_kinds.discover_kinds import KindsDiscovery, KindsStep
from jointscope.graphs.across_kinds.said_by_kinds import MOTION, RESTS
from jointscope.graphs.across_kinds.shared_effect import own_names
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.tools.presentation.numbers import percent, significant
from jointscope.tools.terminal.searches.arm_discovery_text import moved_sentences
from jointscope.tools.terminal.searches.kinds_text import HEAD, WORDS, kinds_headline, kinds_rows, kinds_sentences
from jointscope.tools.terminal.text_table import text_table

COLUMNS = {
    MOTION: "motion [sigma]",
    POSES: "poses [sigma]",
    FREQUENCY: "torques left",
    RESTS: "rests [sigma]",
}
OF_BAND = "rests [of friction]"  # of motors alone: what friction cannot hold


def kinds_discovery_text(found: KindsDiscovery) -> str:
    """The steps, then what was looked at last."""
    head, rows = kinds_steps(found)
    last = found.steps[-1].found
    parts = [text_table(head, rows, "<<" + ">" * (len(head) - 2))]
    parts.append(f"The search ended because {found.stop_reason}.")
    parts += ["\n".join(f"  - {line}" for line in kinds_found(found))] if len(found.steps) > 1 else []
    parts.append("\n".join([left_said(found), *(f"  - {sentence}" for sentence in kinds_sentences(last))]))
    if found.steps[0].found.arm_base is not None:
        parts[:0] = moved_sentences(found.steps[0].found.arm_base)
    return "\n\n".join([*parts, text_table(HEAD, kinds_rows(last), "<" * len(HEAD))])


def left_said(found: KindsDiscovery) -> str:
    """What all kinds say of the last model."""
    return f"The last model: {kinds_headline(found.steps[-1].found)}"


def kinds_steps(found: KindsDiscovery) -> tuple[list[str], list[list[str]]]:
    """Names of the columns, and a row per step: errors for training, then of recordings that were held out."""
    columns = dict(COLUMNS)
    if found.given.rests and found.given.rests[0].q_link is None:
        columns[RESTS] = OF_BAND
    held = [kind for kind in found.given.kinds if kind in found.held.kinds]
    head = ["step", "model", *(columns[kind] for kind in found.given.kinds)]
    head += [f"held out: {columns[kind]}" for kind in held]
    rows = []
    for k, (step, (train, heldout)) in enumerate(zip(found.steps, found.errors, strict=True)):
        cells = [_cell(kind, train[kind], columns) for kind in found.given.kinds]
        rows.append([str(k), step_label(step), *cells, *(_cell(kind, heldout[kind], columns) for kind in held)])
    return head, rows


def step_label(step: KindsStep) -> str:
    """What changed."""
    if step.added is not None:
        return f"+ {step.added.label}"
    return f"- {step.removed}" if step.removed else "base model"


def kinds_found(found: KindsDiscovery) -> list[str]:
    """Of each effect that came in: who shows it, who cannot, its sizes in the one graph, and what it was told from."""
    lines = []
    for k, step in enumerate(found.steps[1:], start=1):
        c = step.added
        if c is None:
            lines.append(f"{step.removed} was taken out: its sizes fell back to nothing beside what came in later")
            continue
        silent = [kind for kind, said in c.by_kind.items() if said.verdict == "untestable"]
        line = f"{c.label} is shown by {_words(c.shown_by)}"
        line += f" and cannot be shown by {_words(silent)}" if silent else ""
        lines.append(f"{line}; from all kinds: {_sizes(found, k)}")
        for kind, labels in c.told_apart.items():
            lines.append(f"{' or '.join(labels)} would do the same in another kind; with {WORDS[kind]} it is {c.label}")
        if c.look_alikes:
            lines.append(f"{c.label} cannot be told from {', '.join(c.look_alikes)} by these recordings")
    return lines


def _sizes(found: KindsDiscovery, k: int) -> str:
    """What the last model has for the effect of a step; what that step had where it was taken out later."""
    names = own_names(found.steps[k].model.robot, found.steps[k - 1].model.robot)
    parameters = found.robot.parameters
    if not any(name in parameters for name in names):
        parameters = found.steps[k].model.robot.parameters
    said = []
    for name in names:
        p = parameters.get(name)
        if p is not None and not p.fixed:
            sigma = "" if p.sigma is None else f" +- {significant(p.sigma, 2)}"
            said.append(f"{name} {significant(p.value, 3)}{sigma} {p.unit}")
    return ", ".join(said)


def _words(kinds: tuple[str, ...] | list[str]) -> str:
    return " and ".join(WORDS[kind] for kind in kinds)


def _cell(kind: str, value: float, columns: dict[str, str]) -> str:
    share = kind == FREQUENCY or columns[kind] == OF_BAND
    return percent(value) if share else significant(value, 3)
