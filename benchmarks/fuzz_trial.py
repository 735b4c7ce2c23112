# SPDX-License-Identifier: BSD-3-Clause
"""One trial of the fuzzer: a damaged bag goes through the verbs in this process, which have rules to keep.

Never a traceback, whatever comes: an error is one line, and files are whole or not there.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import tempfile
import traceback
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_messages import FORMATS, URDF, sound_messages, write_messages
from fuzz_mutations import OF_BYTES, OF_MESSAGES

from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.command_line import TRACEBACK, main

MEMORY = 2 * 2**30  # [B] that a trial may need beside what the modules take


@dataclass(frozen=True)
class Finding:
    """A rule that was broken.

    Attributes:
        trial: number of the trial; it makes the same bag again.
        deep: whether it went through `calibrate` and `replay`.
        damage: names of the mutations.
        verb: what broke it.
        what: how.
        where: the last lines of the traceback, the innermost of our own.
    """

    trial: int
    deep: bool
    damage: str
    verb: str
    what: str
    where: str = ""

    def to_json(self) -> dict[str, Any]:
        """For the pipe to whoever started the trials."""
        return asdict(self)


def run_trial(trial: int, deep: bool = False) -> list[Finding]:
    """Makes the bag of a trial and types the verbs: `info` and `init`, or `calibrate` and `replay`."""
    with tempfile.TemporaryDirectory(prefix="jointscope-fuzz-") as place:
        folder = Path(place)
        bag, damage = damaged_bag(trial, folder, bytes_too=not deep)
        (folder / "two.urdf").write_text(URDF, encoding="utf-8")
        if deep:
            (folder / "two.yaml").write_text(sound_robot_file(), encoding="utf-8")
            lines = [
                ["calibrate", "two.yaml", bag, "-o", "out.yaml", "--json", "out.json"],
                ["replay", "two.yaml", bag, "-o", "out.csv"],
            ]
        else:
            lines = [["info", bag], ["init", "two.urdf", bag, "-o", "out.yaml"]]
        before = {path.name for path in folder.iterdir()}
        found = []
        for line in lines:
            broken, where = _type(line, folder, before)
            found += [Finding(trial, deep, damage, line[0], what, where) for what in broken]
        return found


def damaged_bag(trial: int, folder: Path, bytes_too: bool = True) -> tuple[str, str]:
    """Writes the bag of a trial into a folder; returns its name and what was done to it."""
    rng = np.random.default_rng([trial, 20])
    fmt = FORMATS[trial % len(FORMATS)]
    of_bytes = bytes_too and bool(rng.random() < 0.5)
    names = [str(name) for name in rng.choice(list(OF_BYTES if of_bytes else OF_MESSAGES), int(rng.integers(1, 4)))]
    messages = list(sound_messages())
    if not of_bytes:
        for name in names:
            messages = OF_MESSAGES[name](rng, messages)
    bag = write_messages(folder / "train", messages, fmt)
    if of_bytes:
        # of a folder either the storage or its description
        file = bag if bag.is_file() else sorted(bag.iterdir())[int(rng.integers(2))]
        data = file.read_bytes()
        for name in names:
            data = OF_BYTES[name](rng, data) if data else data
        file.write_bytes(data)
    return bag.name, f"{fmt}: {', '.join(names)}"


@cache
def sound_robot_file() -> str:
    """The robot file that `init` makes of the sound recording."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "two.urdf").write_text(URDF, encoding="utf-8")
        bag = write_messages(folder / "train", sound_messages(), "mcap")
        code, _, err = _run(["init", "two.urdf", bag.name, "-o", "two.yaml"], folder)
        if code:
            raise AssertionError(f"the sound recording is refused: {err}")
        return (folder / "two.yaml").read_text(encoding="utf-8")


def limit_memory() -> None:
    """What is asked for beyond is refused: the modules that are loaded, and two gigabytes."""
    sound_robot_file()
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def megabytes() -> float:
    """The most that this process has held so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _is_one_line(err: str) -> bool:
    """Whether an error is one line, behind the notes of a first look at the recording at the most."""
    *notes, error = err.splitlines() or [""]
    noted = not notes or notes[-1].startswith("Look at this first: ")
    return noted and err.endswith("\n") and error.startswith("jointscope: error: ")


def _type(line: Sequence[str], folder: Path, before: set[str]) -> tuple[list[str], str]:
    """Runs a verb; says which rules it broke and where."""
    broken = []
    code, _, err = _run(line, folder)
    if code not in (0, 1, 2):
        broken.append(f"exit code {code}")
    if code == 1 and not _is_one_line(err):
        broken.append(f"the error is not one line: {err[:300]!r}")
    if "bug in jointscope" in err or "out of memory" in err or "Traceback" in err:
        broken.append(err.strip()[-400:])
    if "Warning: " in err:
        broken.append(f"a library warns: {err.strip()[-300:]}")
    made = {path.name for path in folder.iterdir()} - before
    if code and made:
        broken.append(f"left {', '.join(sorted(made))} after an error")
    if any(name.startswith(".") for name in made):
        broken.append(f"left {', '.join(sorted(made))}")
    if code == 0:
        broken += _unreadable(folder)
    where = _where(line, folder) if broken else ""
    for name in made:
        (folder / name).unlink()
    return broken, where


def _unreadable(folder: Path) -> list[str]:
    """Files that were written and cannot be read."""
    broken = []
    if (folder / "out.yaml").exists():
        try:
            load_robot(folder / "out.yaml")
        except Exception as err:
            broken.append(f"wrote a robot file that cannot be read: {type(err).__name__}: {err}")
    if (folder / "out.json").exists():
        json.loads((folder / "out.json").read_text(encoding="utf-8"))
    return broken


def _run(line: Sequence[str], folder: Path) -> tuple[int, str, str]:
    """Exit code and texts of a verb, run in a folder."""
    out, err = io.StringIO(), io.StringIO()
    here = os.getcwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = main(list(line))
            except SystemExit as end:
                code = int(end.code or 0)
    finally:
        os.chdir(here)
    return code, out.getvalue(), err.getvalue()


def _where(line: Sequence[str], folder: Path) -> str:
    """The end of the traceback behind an error."""
    os.environ[TRACEBACK] = "1"
    try:
        _run(line, folder)
    except JointscopeError:
        return ""
    except Exception as err:
        frames = traceback.extract_tb(err.__traceback__)
        own = [f"{Path(f.filename).name}:{f.lineno} {f.name}" for f in frames if "jointscope" in f.filename]
        return " > ".join(own[-3:]) + f"; innermost {Path(frames[-1].filename).name}:{frames[-1].lineno}"
    finally:
        del os.environ[TRACEBACK]
    return ""
