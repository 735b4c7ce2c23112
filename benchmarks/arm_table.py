# SPDX-License-Identifier: BSD-3-Clause
"""The table of arms and what was promised about them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import median

from arm_row import ADVISED, BROKEN, MISLED, OUTCOMES, PERCENT, RIGHT, SIGMAS, STUCK, WRONG, ArmRow
from tables import Section, Table

SHARE = 0.9
HEAD = ("robot", "recorded", "outcome", "verdict", "largest error [%]", "CPU [s]", "of it init", "MB", "ended at")


def section(rows: Sequence[ArmRow]) -> Section:
    """Targets and the table."""
    found = Section(
        "First contact",
        f"{len(rows)} robots as their makers ship them, 10 s of several sines each: `init`, `info` and `calibrate` as "
        f"typed. Right: every rotor inertia, dry and viscous friction and torque constant within {PERCENT:g} % or "
        f"{SIGMAS:g} sigma, and the verdict Yes or Usable.",
    )
    if not rows:
        return found
    counted = Counter(row.outcome for row in rows)
    right = counted[RIGHT]
    found.promise("right as typed", f"{SHARE:.0%}", f"{right} of {len(rows)}", right >= SHARE * len(rows))
    found.promise("wrong and called good or usable", "none", str(counted[WRONG]), counted[WRONG] == 0)
    refused = counted[ADVISED] + counted[MISLED] + counted[STUCK]
    found.promise(
        "refused with the command to type, which then works",
        "all refused",
        f"{counted[ADVISED]} of {refused}",
        counted[ADVISED] == refused,
    )
    found.promise("ended in a traceback, a crash or not at all", "none", str(counted[BROKEN]), counted[BROKEN] == 0)
    failed = [row for row in rows if row.promised and not row.verdict]
    found.promise("failed after `init` and `info` had said that it can be used", "none", str(len(failed)), not failed)
    accused = [(row.name, text) for row in rows for text in row.accused]
    found.promise("pushes and mistakes named, of which there are none", "none", str(len(accused)), not accused)
    cpu, init = [row.cpu for row in rows], [row.init_cpu for row in rows]
    found.promise("CPU of the three commands: median", "", f"{median(cpu):.0f} s, most {max(cpu):.0f} s")
    found.promise("of it `init`: most", "below 5 s", f"{max(init):.1f} s", max(init) < 5.0)
    found.promise("memory: most", "", f"{max(row.megabytes for row in rows):.0f} MB")
    found.tables.append(Table("Robots", HEAD, [cells(row) for row in rows]))
    order = {outcome: k for k, outcome in enumerate(OUTCOMES)}
    for row in sorted(rows, key=lambda row: order[row.outcome]):
        if row.outcome != RIGHT:
            found.notes.append(f"{row.name} ({row.outcome}): {row.message}")
            found.notes += [f"{row.name}: advised `jointscope {advice}`" for advice in row.advice]
    found.notes += [f"{name}: named although it is not there: {text}" for name, text in accused]
    found.numbers["rows"] = [row.to_json() for row in rows]
    return found


def cells(row: ArmRow) -> tuple[str, ...]:
    """One line of the table."""
    largest = "" if row.largest is None else f"{row.largest:.2g}"
    figures = (largest, f"{row.cpu:.0f}", f"{row.init_cpu:.1f}", f"{row.megabytes:.0f}")
    return (row.name, row.variant, row.outcome, row.verdict, *figures, row.ended_at)
