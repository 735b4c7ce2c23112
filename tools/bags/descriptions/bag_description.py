# SPDX-License-Identifier: BSD-3-Clause
"""What `jointscope info` says about a bag: as a dictionary for machines and as a table for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from jointscope.tools.bags.clocks.durations import counted


@dataclass(frozen=True)
class FieldDescription:
    """The numbers in one field of a topic.

    Attributes:
        field: dotted path.
        columns: name of each column: joint names, or x, y, z, or indices.
        minimum, maximum: of each column over the finite samples, in the unit of the bag; NaN where there are none.
        not_finite: number of values that are NaN or infinite.
        clipping: a sentence for each column that stays at its extreme value while it moves.
    """

    field: str
    columns: tuple[str, ...]
    minimum: tuple[float, ...]
    maximum: tuple[float, ...]
    not_finite: int
    clipping: tuple[str, ...]


@dataclass(frozen=True)
class TopicDescription:
    """One topic.

    Attributes:
        topic: its name.
        msgtype: type of its messages.
        count: number of messages.
        rate: messages per second by stamp, of the fastest node where several publish [1/s].
        jitter: standard deviation of the steps that are no gaps [s].
        gaps: number of steps in which messages are missing.
        missing: estimated number of messages that are missing there.
        longest_gap: [s].
        out_of_order, duplicates: messages concerned.
        stamped: whether the messages carry a stamp; if not, the time of reception is used.
        names: joint names.
        fields: its numbers.
        trouble: why the topic cannot be read; None where it can.
        remarks: what was left out or mended, a sentence each.
    """

    topic: str
    msgtype: str
    count: int
    rate: float = 0.0
    jitter: float = 0.0
    gaps: int = 0
    missing: int = 0
    longest_gap: float = 0.0
    out_of_order: int = 0
    duplicates: int = 0
    stamped: bool = True
    names: tuple[str, ...] = ()
    fields: tuple[FieldDescription, ...] = ()
    trouble: str | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class NeedDescription:
    """One stream that the robot needs.

    Attributes:
        stream: "command" or the sensor's name.
        topic, msgtype, field, unit: where the robot file expects it.
        problem: what is missing; None where all is there.
        candidates: topics of the bag with that message type.
    """

    stream: str
    topic: str
    msgtype: str
    field: str
    unit: str
    problem: str | None
    candidates: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class BagDescription:
    """A bag, and how it fits a robot.

    Attributes:
        path: where it lies.
        sha256: hash of its content.
        kind: "ROS 1" or "ROS 2".
        size: [bytes].
        duration: from the first to the last message [s].
        topics: all of them.
        robot: name of the robot it was compared with; None without one.
        needs: what that robot needs.
        usable: whether the recording can be used for that robot; None without one.
        problem: why not.
        rests: how many it has for that robot, if it is a recording of these; None of motion.
        notices: what was dropped or looked odd, for that robot.
        transmission: joint angles per motor angle of that robot, row by row; None where each motor moves its own.
    """

    path: str
    sha256: str
    kind: str
    size: int
    duration: float
    topics: tuple[TopicDescription, ...]
    robot: str | None = None
    needs: tuple[NeedDescription, ...] = ()
    usable: bool | None = None
    problem: str | None = None
    rests: int | None = None
    notices: tuple[str, ...] = field(default_factory=tuple)
    transmission: tuple[tuple[float, ...], ...] | None = None

    def to_json(self) -> dict[str, Any]:
        """The description as plain lists, dictionaries, texts and numbers; NaN becomes None."""
        plain = _plain(asdict(self))
        assert isinstance(plain, dict)
        return plain

    def __repr__(self) -> str:
        """What `print` shows."""
        return self.text()

    def text(self) -> str:
        """The description as a table."""
        lines = [
            f"{self.path}: {self.kind}, {self.size / 1e6:.1f} MB, {self.duration:.3f} s, "
            f"{sum(topic.count for topic in self.topics)} messages, sha256 {self.sha256[:12]}",
            "",
        ]
        lines += _table([_HEAD, *(_row(topic) for topic in self.topics)])
        for topic in self.topics:
            lines += _details(topic)
        if self.robot is not None:
            lines += ["", *self._robot_lines()]
        return "\n".join(lines)

    def _robot_lines(self) -> list[str]:
        rows = [("needed by " + str(self.robot), "topic", "field", "unit", "in the bag")]
        rows += [(n.stream, n.topic, n.field, n.unit, "yes" if n.problem is None else "NO") for n in self.needs]
        lines = _table(rows)
        for need in self.needs:
            if need.problem is not None:
                lines.append(f"{need.stream}: {need.problem}")
                if need.candidates:
                    lines.append(f"    topics of that type: {', '.join(need.candidates)}")
        if self.transmission is not None:
            lines.append("transmission: joint angles = matrix times motor angles")
            lines += [f"    {row}" for row in _table([tuple(f"{v:.6g}" for v in row) for row in self.transmission])]
        lines += [f"note: {notice}" for notice in self.notices]
        if self.usable:
            how = "" if self.rests is None else f" as one of rests (--rests): {counted(self.rests, 'rest')}"
            lines.append(f"The recording can be used for {self.robot}{how}.")
        else:
            lines.append(f"The recording cannot be used for {self.robot}: {self.problem}")
        return lines


_HEAD = ("topic", "type", "messages", "rate [Hz]", "jitter [ms]", "gaps", "missing", "longest [s]")


def _row(topic: TopicDescription) -> tuple[str, ...]:
    if not topic.fields:
        return (topic.topic, topic.msgtype, str(topic.count), "", "", "", "", "")
    return (
        topic.topic,
        topic.msgtype,
        str(topic.count),
        f"{topic.rate:.2f}",
        f"{1e3 * topic.jitter:.3f}",
        str(topic.gaps),
        str(topic.missing),
        f"{topic.longest_gap:.4g}" if topic.gaps else "",
    )


def _details(topic: TopicDescription) -> list[str]:
    lines = [f"    cannot be read: {topic.trouble}"] if topic.trouble else []
    if topic.out_of_order or topic.duplicates:
        lines.append(f"    {topic.out_of_order} messages out of order, {topic.duplicates} repeat a stamp")
    lines += [f"    {remark}" for remark in topic.remarks]
    if topic.fields and not topic.stamped:
        lines.append("    without header: times are those of reception")
    for part in topic.fields:
        if not part.columns:
            continue
        ranges = [
            f"{name} {low:.4g} .. {high:.4g}" if not math.isnan(low) else f"{name} none"
            for name, low, high in zip(part.columns, part.minimum, part.maximum, strict=True)
        ]
        lines.append(f"    {part.field}: {', '.join(ranges)}")
        if part.not_finite:
            lines.append(f"        {part.not_finite} values are not finite")
        lines += [f"        {sentence.strip()}" for sentence in part.clipping]
    return ["", topic.topic, *lines] if lines else []


def _table(rows: Sequence[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
