# SPDX-License-Identifier: BSD-3-Clause
"""Strings between motor and link that pull beyond a deflection only: tendons of the engine with a range of lengths."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointscope.tools.simulator.world.specification import add_tendon, set_linear, spring_tendon


def slack_of(spec: Any, joint: str) -> tuple[float, float]:
    """The deflections between which a joint's spring is slack [rad]."""
    low, high = np.ravel(spec.tendon(spring_tendon(joint)).springlength)
    return float(low), float(high)


def add_string(
    spec: Any, name: str, joint: str, shares: Mapping[str, float], stiffness: float, slack: tuple[float, float]
) -> None:
    """Adds a tendon beside a joint's spring that is slack between two deflections [rad], with its stiffness beyond."""
    tendon = add_tendon(spec, name, joint, shares)
    set_linear(tendon, "stiffness", stiffness)
    tendon.springlength = list(slack)
