# SPDX-License-Identifier: BSD-3-Clause
"""Effects that add to elements of the matrix between motor and joint angles: q_joint = T q_motor."""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.robots.effect_kinds.effect import Effect

FROM = "from_"  # of the parameter from_<joint>: which motor's column of the owner's row


@dataclass(frozen=True, kw_only=True)
class TransmissionElements(Effect):
    """A parameter from_<joint> is added to the element (owner, joint) of T; the owner must have a spring."""
