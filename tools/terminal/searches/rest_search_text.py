# SPDX-License-Identifier: BSD-3-Clause
"""What rests say a model lacks: the ranking of effects, and the steps of a discovery."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.graphs.rest_search.discover_rests import RestDiscovery
from jointscope.graphs.rest_search.rest_judge import RestCandidate
from jointscope.tools.presentation.numbers import fall_text, significant, with_sigma
from jointscope.tools.terminal.rests_text import rest_notices, rest_values
from jointscope.tools.terminal.text_table import text_table

SHOWN = 8
LOADS = "load_scale@robot"
MOST_NAMES = 4  # look-alikes that are named in a row


def rest_search_text(found: RestDiscovery) -> str:
    """The steps, and what was looked at last; of a diagnosis the one model and what it lacks."""
    head, rows = step_table(found)
    notices = rest_notices([*found.recordings, *found.holdout])
    parts = ["\n".join([text_table(head, rows, "<<" + ">" * (len(head) - 2)), *notices])]
    if found.stop_reason:
        parts.append(f"The search ended because {found.stop_reason}.")
    parts += [f"{step.added.label}: {sizes_said(step.added)}{_alike(step.added)}" for step in found.steps if step.added]
    values = [rest_values(found.steps[-1].result)] if found.stop_reason else []
    ends = [headline(found), *values, ranking_text(found), *untestable_said(found.candidates)]
    return "\n\n".join([*parts, *ends])


def step_table(found: RestDiscovery) -> tuple[list[str], list[list[str]]]:
    """Names of the columns, and a row per step; those of rests that were held out only where there are any."""
    joints = found.robot.joints
    torque = [f"{joint} [mN m]" for joint in joints]
    head = ["step", "model", "links off [sigma]", *torque]
    head += ["held out [sigma]", *torque] if found.holdout else []
    rows = []
    for k, (step, both) in enumerate(zip(found.steps, found.errors_of_steps, strict=True)):
        row = [str(k), step.added.label if step.added else "base model"]
        for errors in both:
            if errors is not None:
                missing = errors.torques(found.robot)
                row += [significant(errors.error, 3), *(significant(1e3 * missing[joint], 3) for joint in joints)]
        rows.append(row)
    return head, rows


def headline(found: RestDiscovery) -> str:
    """Whether something is missing."""
    missing = [c.label for c in found.candidates if c.verdict == "missing"]
    if missing:
        return f"Missing: {', '.join(missing)}.{loads_said(found.candidates)}"
    small = [c.label for c in found.candidates if c.verdict == "possible"]
    said = "Nothing of the catalogue is missing at these rests."
    if small:
        said += f" There may be a little of {', '.join(small[:MOST_NAMES])}, too small to tell on rests left out."
    return said + loads_said(found.candidates)


def loads_said(candidates: Sequence[RestCandidate]) -> str:
    """How large known loads are where they are not as large as said; empty where nothing speaks of it."""
    scale = next((c for c in candidates if c.label == LOADS and c.verdict in ("missing", "possible")), None)
    if scale is None:
        return ""
    share, sigma, _ = scale.sizes["share"]
    value, off = with_sigma(1.0 + share, sigma)
    if scale.verdict == "missing":
        return f" The loads are {value} +- {off} of what /load says."
    others = ", ".join(c.label for c in candidates if c.verdict == "missing")
    instead = f"in place of {others} " if others else ""
    return f" Or {instead}the loads are {value} +- {off} of what /load says: these rests can hardly decide which."


def ranking_text(found: RestDiscovery) -> str:
    """The effects that were looked at, best first."""
    count = sum(len(rests) for rests in found.recordings)
    tested = [c for c in found.candidates if c.verdict != "untestable"]
    told = (
        f"{count} rests; {len(tested)} effects were scored, and the leading ones fitted to all but one group of rests "
        "and judged by that, in turn"
    )
    head, rows = ranking_table(tested)
    return f"{told}\n{text_table(head, rows, '<<>>>>><')}"


def ranking_table(tested: Sequence[RestCandidate]) -> tuple[list[str], list[list[str]]]:
    """Names of the columns, and a row for each of the first effects."""
    rows = []
    for c in tested[:SHOWN]:
        judged = ["-", "-"] if c.gains is None else [significant(c.gain, 3), f"{100.0 * c.helped:.0f} %"]
        names = [*c.look_alikes[:MOST_NAMES], *(["..."] if len(c.look_alikes) > MOST_NAMES else [])]
        row = [c.label, c.verdict, fall_text(c.score), str(c.dof), f"{c.p_value:.1g}", *judged, ", ".join(names)]
        rows.append(row)
    head = ["effect", "verdict", "chi2 falls by", "dof", "p", "log likelihood left out", "of the groups", "look-alikes"]
    return head, rows


def untestable_said(candidates: Sequence[RestCandidate]) -> list[str]:
    """Effects that these rests cannot show, by reason, each effect once."""
    by_reason: dict[str, list[str]] = {}
    seen = {c.label.partition("@")[0] for c in candidates if c.verdict != "untestable"}
    for c in candidates:
        effect = c.label.partition("@")[0]
        name = c.label if effect in seen else effect
        if c.verdict == "untestable" and name not in by_reason.setdefault(c.why, []):
            by_reason[c.why].append(name)
    return [f"Not testable by these rests: {', '.join(names)} ({why})." for why, names in by_reason.items()]


def sizes_said(candidate: RestCandidate) -> str:
    """The sizes of an effect with their sigmas."""
    sizes = candidate.sizes.items()
    parts = (f"{n} = {significant(value, 4)} +- {significant(sigma, 2)} {unit}" for n, (value, sigma, unit) in sizes)
    return ", ".join(parts)


def _alike(candidate: RestCandidate) -> str:
    if not candidate.look_alikes:
        return ""
    return f"; these rests cannot tell it from {', '.join(candidate.look_alikes)}"
