# SPDX-License-Identifier: BSD-3-Clause
"""What `init` writes and says about joints that are held."""

from __future__ import annotations

from collections.abc import Sequence

from jointscope.tools.init.streams.other_joints import NO_NUMBER, NOT_THERE, HeldJoint
from jointscope.tools.init.text.robot_line import as_list, line, plain


def held_lines(held: Sequence[HeldJoint]) -> list[str]:
    """The section of a robot file that says where other joints stand."""
    if not held:
        return []
    lines = [line("locked:", "other joints that matter, [rad] or [m]")]
    lines += [line(f"{plain(h.joint)}: {_position(h.position)}", h.reason, False, 2) for h in held]
    on_word = [h.joint for h in held if h.on_word]
    return lines + [line(f"held_at_mean: {as_list(on_word)}", "these move; held on your word")] * bool(on_word)


def locked_line(held: Sequence[HeldJoint]) -> str:
    """One line for the screen about joints that are held; empty if there are none."""
    ways = (
        ("stand still in the recording", [h for h in held if h.seen and not h.on_word]),
        ("held at their mean on your word", [h for h in held if h.on_word]),
        (NOT_THERE, [h for h in held if not h.seen and h.reason == NOT_THERE]),
        (NO_NUMBER, [h for h in held if not h.seen and h.reason == NO_NUMBER]),
    )
    parts = [
        ", ".join(f"{h.joint} {h.position:.4g}" if h.seen else h.joint for h in those) + f" ({why})"
        for why, those in ways
        if those
    ]
    return f"locked: {'; '.join(parts)}" if parts else ""


def _position(value: float) -> str:
    """A position to a tenth of a milliradian or better, as YAML reads a float."""
    return f"{value:.6f}".rstrip("0").ljust(3 + (value < 0), "0")
