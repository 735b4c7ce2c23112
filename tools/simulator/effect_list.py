# SPDX-License-Identifier: BSD-3-Clause
"""The effects that can be simulated, as text for the help of the command line."""

from __future__ import annotations

import textwrap

from jointscope.tools.simulator.effects import simulated_effects

HEADINGS = {
    "catalogue": "effects of the catalogue, by owner",
    "outside": "effects outside the catalogue: a diagnosis should say that something is left",
    "mistake": "not physics, but mistakes in the bag",
}
EXAMPLES = {
    "joint": "joint1",
    "joint seen on the link": "joint1.link",
    "elastic joint": "joint1 (elastic)",
    "last joint": "the last joint",
    "imu": "imu1",
    "robot": "robot",
    "target": "target",
    "link encoders": "link_encoder",
    "upright robot": "robot (upright)",
    "robot with a target": "robot (with poses)",
    "weighed elastic joint": "joint1 (elastic, under gravity)",
}
WIDTH = 100


def effect_list() -> str:
    """All ids in three groups, and in each by what they act on."""
    lines = []
    for kind, heading in HEADINGS.items():
        lines.append(f"{heading}:")
        by_owner: dict[tuple[str, ...], list[str]] = {}
        for effect in simulated_effects().values():
            if effect.kind() == kind:
                by_owner.setdefault(effect.acts_on, []).append(effect.id)
        for owners, ids in sorted(by_owner.items()):
            head = f"  {', '.join(EXAMPLES[owner] for owner in owners):<15} "
            lines += textwrap.wrap(", ".join(ids), WIDTH, initial_indent=head, subsequent_indent=" " * len(head))
    return "\n".join(lines)
