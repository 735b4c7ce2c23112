# SPDX-License-Identifier: BSD-3-Clause
"""The topic of known loads that hang on an arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jointscope.tools.bags.messages.open_bag import open_bag

LOAD = "/load"
LOAD_TYPE = "geometry_msgs/msg/WrenchStamped"


def load_messages(path: Path) -> tuple[str, list[Any]] | None:
    """The type of the topic, and its messages where that is `LOAD_TYPE`; None of a bag without it."""
    with open_bag(path) as bag:
        if LOAD not in bag.topics:
            return None
        kind = bag.message_type(LOAD)
        if kind.name != LOAD_TYPE:
            return kind.name, []
        return kind.name, [kind.decode(raw) for raw in bag.read([LOAD])[LOAD].data]


def largest_load(path: Path) -> float:
    """Largest force of the topic of loads; 0 where there is none, or something else has its name [N]."""
    _, messages = load_messages(path) or ("", [])
    forces = [message.wrench.force for message in messages]
    sizes = [float(np.linalg.norm([force.x, force.y, force.z])) for force in forces]
    return max(sizes, default=0.0)
