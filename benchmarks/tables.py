# SPDX-License-Identifier: BSD-3-Clause
"""What a section of the benchmark hands back: sentences and tables, printed as markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Attributes:
        title: one line above it.
        head: titles of the columns.
        rows: cells; numbers are already formatted.
    """

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]

    def markdown(self) -> str:
        """The table with its columns lined up."""
        widths = [max(len(line[k]) for line in (self.head, *self.rows)) for k in range(len(self.head))]
        rule = tuple("-" * width for width in widths)
        lines = [_line(cells, widths) for cells in (self.head, rule, *self.rows)]
        return "\n".join([f"**{self.title}**", "", *lines, ""])


@dataclass(frozen=True)
class Target:
    """One promise and what became of it.

    Attributes:
        what: the quantity.
        target: the promise in words.
        measured: the figure with its unit.
        met: whether the promise is kept; None for a figure that stands beside it without a promise.
    """

    what: str
    target: str
    measured: str
    met: bool | None = None


@dataclass
class Section:
    """Everything that one section found.

    Attributes:
        title: its name.
        setting: sentences that say what was measured and how.
        targets: promises with their figures, shown first.
        tables: details.
        notes: sentences at the end, for example why something was skipped.
        numbers: the same for machines.
    """

    title: str
    setting: str
    targets: list[Target] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    numbers: dict[str, Any] = field(default_factory=dict)

    def promise(self, what: str, target: str, measured: str, met: bool | None = None) -> None:
        """Adds a promise with its figure."""
        self.targets.append(Target(what, target, measured, None if met is None else bool(met)))

    def markdown(self) -> str:
        """The section as it goes into a README."""
        parts = [f"## {self.title}", "", self.setting, ""]
        if self.targets:
            rows = [(t.what, t.target, t.measured, answer(t.met)) for t in self.targets]
            parts.append(Table("Targets", ("quantity", "target", "measured", "met?"), rows).markdown())
        parts += [table.markdown() for table in self.tables]
        parts += [f"- {note}" for note in self.notes] + [""] * bool(self.notes)
        return "\n".join(parts)

    def to_json(self) -> dict[str, Any]:
        """The section for machines."""
        return {"title": self.title, "targets": [asdict(t) for t in self.targets], **self.numbers, "notes": self.notes}


def answer(met: bool | None) -> str:
    """Whether a promise is kept, in a word."""
    return "" if met is None else "yes" if met else "**no**"


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    return "| " + " | ".join(f"{cell:{width}}" for cell, width in zip(cells, widths, strict=True)) + " |"
