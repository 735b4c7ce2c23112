# SPDX-License-Identifier: BSD-3-Clause
"""Inputs and outputs of any system from a bag, and how they were excited.

A signal is named TOPIC:FIELD or TOPIC:FIELD:NAME,NAME; where nothing is named, it is the motors of /joint_states,
torque in and position out, of the joints that /motor_command names, or what excitation.yaml beside the bag names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from jointscope.graphs.responses.find_excitation import find_excitation
from jointscope.graphs.responses.settled_periods import settled
from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.excitation_file import (
    Connections,
    excitation_beside,
    read_connections,
    read_excitation,
)
from jointscope.robots.recordings.signals import Excitation, Signal, Signals
from jointscope.robots.yaml_section import did_you_mean
from jointscope.tools.bags.fitting_messages import read_columns
from jointscope.tools.bags.messages.field_path import field_path
from jointscope.tools.bags.messages.open_bag import Bag, RawTopic, bag_sha256, open_bag

INPUT, OUTPUT, COMMAND = "/joint_states:effort", "/joint_states:position", "/motor_command:effort"


def read_signals(
    path: Path, source: str = "", target: str = "", led: bool = False, file: Path | None = None
) -> tuple[Signals, Signal]:
    """The signals of a bag, and the one that drives them: the command where there is one and nothing was named.

    Args:
        path: a bag.
        source: what goes in.
        target: what comes out.
        led: whether the command drives although signals are named.
        file: that describes the excitation, and may name signals; by default the one beside the bag.

    Raises:
        RecordingError: the bag cannot be read, or has no such signal.
    """
    file = file or excitation_beside(path)
    said = Connections() if file is None else read_connections(file)
    source, target = source or said.inputs, target or said.outputs
    with open_bag(path) as bag:
        specs = [source or INPUT, target or OUTPUT]
        led = (led or not source + target) and COMMAND.partition(":")[0] in bag.topics
        specs += [COMMAND] if led else []
        topics = list(dict.fromkeys(spec.partition(":")[0] for spec in specs))
        absent = next((topic for topic in topics if topic not in bag.topics), None)
        if absent is not None:
            hint = did_you_mean(absent, bag.topics) or f"; there are {', '.join(bag.topics) or 'none'}"
            raise RecordingError(
                f"{path}: topic {absent} is missing{hint}; name inputs and outputs with --from and --to"
            )
        raw = bag.read(topics)
        found: list[Signal] = []
        starts: list[int] = []
        joints: tuple[str, ...] = ()
        for spec in reversed(specs):  # the command first: it says which joints
            signal, first = _signal(bag, raw, spec, joints)
            joints = signal.names if led else ()
            found.insert(0, signal)
            starts.insert(0, first)
    moved = [replace(s, times=s.times + (first - min(starts)) / 1e9) for s, first in zip(found, starts, strict=True)]
    inputs, outputs = moved[:2]
    inputs = replace(inputs, held=said.held and _same_field(source or INPUT, said.inputs or INPUT))
    return Signals(str(path), bag_sha256(path), inputs, outputs), moved[-1] if led else inputs


def excitation_of(path: Path, signals: Signals, drive: Signal, file: Path | None = None) -> Excitation:
    """What a file says of the excitation of a bag, or, where there is none, the recording itself.

    Args:
        path: the bag.
        signals: inputs and outputs, which settle after the excitation has begun.
        drive: the signal that was made.
        file: that describes it; by default the one beside the bag.
    """
    file = file or excitation_beside(path)
    if file is not None:
        return read_excitation(file, path, drive.step)
    return settled(signals, find_excitation(drive, len(signals.inputs.names), str(path)))


def _same_field(one: str, other: str) -> bool:
    """Whether two specifications mean the same field of the same topic, whichever names they list."""
    return one.split(":")[:2] == other.split(":")[:2]


def _signal(bag: Bag, raws: Mapping[str, RawTopic], spec: str, names: Sequence[str]) -> tuple[Signal, int]:
    """A signal with times since its first stamp, and that stamp [ns].

    Raises:
        RecordingError: it is not in the bag, or is no number.
    """
    topic, _, rest = spec.partition(":")
    field, _, listed = rest.partition(":")
    wanted = tuple(name.strip() for name in listed.split(",") if name.strip()) or tuple(names)
    if not field:
        raise RecordingError(f"{spec!r}: expected TOPIC:FIELD or TOPIC:FIELD:NAME,NAME, for example {INPUT}")
    kind, raw = bag.message_type(topic), raws[topic]
    field_path(kind, field, topic, "correct TOPIC:FIELD")
    columns = read_columns(raw, kind, field, wanted=wanted)
    stamps = columns.of(raw.received_ns) if columns.stamps is None else columns.stamps
    called = columns.names or tuple(f"{field}[{i}]" for i in range(columns.values.shape[1]))
    missing = [name for name in wanted if name not in called]
    if missing:
        raise RecordingError(f"{bag.path}: topic {topic}: no {missing[0]!r} in it; it names {', '.join(called)}")
    if len(called) != columns.values.shape[1]:
        raise RecordingError(
            f"{bag.path}: topic {topic}: field {field}: {columns.values.shape[1]} values for {len(called)} names"
        )
    order = [called.index(name) for name in wanted or called]
    values = columns.values[:, order]
    rows = np.argsort(stamps, kind="stable")
    rows = rows[np.r_[True, np.diff(stamps[rows]) > 0]]
    if len(rows) < 2:
        raise RecordingError(f"{bag.path}: topic {topic}: {len(rows)} samples; expected a recording")
    if not np.all(np.isfinite(values)):
        raise RecordingError(f"{bag.path}: topic {topic}: field {field}: some values are no numbers; record again")
    times = (stamps[rows] - stamps[rows[0]]) / 1e9
    return Signal(times, values[rows], tuple(called[i] for i in order)), int(stamps[rows[0]])
