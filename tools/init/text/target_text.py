# SPDX-License-Identifier: BSD-3-Clause
"""Lines of a robot file about targets that a tracker measures, and what to type where a bag has positions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from jointscope.tools.init.estimates.target_places import PLACE, TURN, GuessedTarget
from jointscope.tools.init.text.robot_line import as_list, line, number
from jointscope.tools.init.text.source_text import sigma_line

HELD = "the motion does not separate it from the others of this target; held where it was fitted"


def target_lines(target: GuessedTarget) -> list[str]:
    """The section of a sensor."""
    sensor = target.sensor
    rows = [as_list(round(x, 5) for x in row) for row in sensor.tracker_pose.tolist()]
    fitted = f"fitted with rigid joints; {number(target.left)} m (rms) are left"
    return [
        f"  {sensor.name}:",
        "    kind: position_target",
        f"    topic: {sensor.source.topic}",
        f"    type: {sensor.source.msgtype}",
        f"    field: {sensor.source.field}",
        line(f"unit: {sensor.source.unit}", "so that the target is near its link", False, 4),
        f"    target: {sensor.body}",
        line(f"at: {as_list(round(x, 5) for x in sensor.at.tolist())}", f"[m] on its link; {fitted}", False, 4),
        line(f"tracker_pose: [{', '.join(rows)}]", f"base from tracker; {fitted}", False, 4),
        sigma_line(target.noise, sensor.source.unit),
    ]


def target_parameters(targets: Iterable[GuessedTarget]) -> list[str]:
    """What is to be estimated of them."""
    return [
        _parameter(name, unit, name in target.held)
        for target in targets
        for name, unit in target.sensor.parameters.items()
    ]


def _parameter(name: str, unit: str, held: bool) -> str:
    text = f"  {name}: {{value: 0.0, unit: {unit}, positive: false, prior_sigma: {PLACE if unit == 'm' else TURN}"
    return line(f"{text.strip()}, fixed: true}}", HELD, True, 2) if held else f"{text}}}"


def position_hints(topics: Sequence[str], used: Iterable[str], links: Sequence[str]) -> list[str]:
    """What is said of topics with positions that are not used."""
    asked = {text.partition("=")[0] for text in used}
    which = ", ".join(links)
    return [
        f"{topic}: positions of something; if it is on a link, `init` again with --target {topic}=LINK ({which})"
        for topic in topics
        if topic not in asked
    ]
