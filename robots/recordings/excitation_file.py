# SPDX-License-Identifier: BSD-3-Clause
"""`excitation.yaml` beside a bag: f0, lines, and when which experiment took place."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML, YAMLError

from jointscope.robots.errors import RecordingError, RobotError
from jointscope.robots.recordings.signals import Excitation, Experiment
from jointscope.robots.yaml_section import Section

FILE = "excitation.yaml"


@dataclass(frozen=True)
class Connections:
    """What a description says of the signals.

    Attributes:
        inputs, outputs: TOPIC:FIELD or TOPIC:FIELD:NAME,NAME; empty where it does not say.
        held: whether inputs act until the next one, as commands do.
    """

    inputs: str = ""
    outputs: str = ""
    held: bool = False


def excitation_beside(bag: Path) -> Path | None:
    """The file that stands in the folder of a bag, or in the one above; None where there is none."""
    folders = [bag, bag.parent] if bag.is_dir() else [bag.parent]
    return next((folder / FILE for folder in folders if (folder / FILE).is_file()), None)


def read_connections(path: Path) -> Connections:
    """What goes in and what comes out, as a file says.

    Raises:
        RecordingError: it cannot be read.
    """
    with _content(path) as top:
        return Connections(top.text("inputs", ""), top.text("outputs", ""), top.flag("held", False))


@contextmanager
def _content(path: Path) -> Iterator[Section]:
    """What stands in a file; whatever is wrong with it becomes one line."""
    try:
        yield Section(YAML(typ="safe").load(path.read_text(encoding="utf-8")), str(path))
    except (YAMLError, UnicodeDecodeError, ValueError, TypeError) as err:
        raise RecordingError(f"{path}: not a description of an excitation: {' '.join(str(err).split())}") from err
    except RobotError as err:
        raise RecordingError(f"{err}; docs/frequency.md shows such a file") from err


def read_excitation(path: Path, bag: Path, step: float) -> Excitation:
    """What a file says of a bag.

    Args:
        path: the file.
        bag: whose experiments are asked for; experiments name it without the ending.
        step: of its samples [s].

    Raises:
        RecordingError: it cannot be read, or says nothing of this bag, or has another sampling time.
    """
    with _content(path) as top:
        f0, said_lines = top.number("f0", positive=True), np.array(top.raw("lines"), dtype=np.float64)
        lines = said_lines.astype(np.intp)
        said = top.number("sample_time", step, positive=True)
        listed = top.raw("experiments")
        rows = [Section(row, f"{path}: experiments[{i}]") for i, row in enumerate(listed or [])]
        every = [(row.text("bag", bag.stem), _experiment(row)) for row in rows]
        carrier = top.section("reference").number("frequency") if "reference" in top else 0.0
    own = tuple(experiment for name, experiment in every if name == bag.stem)
    if not own:
        names = ", ".join(dict.fromkeys(name for name, _ in every)) or "no bag"
        raise RecordingError(
            f"{path}: no experiment of the bag {bag.stem!r}; it describes {names}: give the file of this bag with "
            "--excitation"
        )
    if abs(said - step) > 0.01 * step:
        raise RecordingError(
            f"{path}: sample_time {said:g} s, but {bag} is sampled every {step:.6g} s; the file belongs to another bag"
        )
    if not lines.size or lines.ndim != 1 or lines.min() < 1 or np.any(lines != said_lines):
        raise RecordingError(f"{path}: lines: expected whole numbers from 1 on, got {said_lines.tolist()}")
    if f0 * lines.max() > 0.5 / step:
        raise RecordingError(
            f"{path}: line {lines.max()} is at {f0 * lines.max():g} Hz, above half the sampling rate of "
            f"{1.0 / step:g} Hz, where it is folded onto another frequency; leave these lines out or record faster"
        )
    keys = [(e.realisation, e.number, e.sign) for e in own]
    twice = next((key for i, key in enumerate(keys) if key in keys[:i]), None)
    if twice is not None:
        raise RecordingError(
            f"{path}: realisation {twice[0]}, experiment {twice[1]}, sign {twice[2]} of the bag {bag.stem!r} is listed "
            "twice; give each experiment a number of its own, and one that comes again another realisation"
        )
    return Excitation(f0, np.unique(lines), own, carrier, str(path))


def _experiment(row: Section) -> Experiment:
    periods, transient = round(row.number("periods", positive=True)), round(row.number("transient", 0.0))
    if periods <= transient:
        raise RobotError(f"{row.place}: {periods} periods of which {transient} are transient; expected one to be left")
    sign = round(row.number("sign", 1.0))
    if sign not in (1, -1):
        raise RobotError(f"{row.place}.sign: expected 1 or -1, got {sign}")
    return Experiment(
        round(row.number("realisation", 0.0)),
        round(row.number("experiment", 0.0)),
        sign,
        row.number("start"),
        periods,
        transient,
    )
