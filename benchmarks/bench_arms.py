# SPDX-License-Identifier: BSD-3-Clause
"""Brings robots as their makers ship them to `init`, `info` and `calibrate`, as a new user does, and prints the table.

Usage: python benchmarks/bench_arms.py [--quick] [--only NAME] [--jobs N] [--folder DIR] [--results FILE] [--table]

A second table says what is named on simulated recordings in which nothing is wrong.
"""

from __future__ import annotations

import argparse
import fnmatch
import hashlib
import json
import multiprocessing
import os
import shutil
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from pathlib import Path

import perfect_recordings
from arm_cases import QUICK, ArmCase, cases
from arm_recording import record
from arm_row import BROKEN, ArmRow, judge
from arm_table import section
from arm_verbs import THREADS, first_contact
from kept_rows import keep, known_rows
from measured_page import environment, write_section
from patience import say

import jointscope.graphs

LIMIT = 900.0  # [s] of computing, of a calibration


def main() -> None:
    arguments = _parse()
    wanted = [case for case in cases() if not arguments.quick or case.name in QUICK]
    wanted = [case for case in wanted if fnmatch.fnmatch(case.name, arguments.only)]
    if arguments.list:
        print("\n".join(f"{case.name}: {case.variant}" for case in wanted))
        return
    arguments.folder.mkdir(parents=True, exist_ok=True)
    known = {name: ArmRow(**row) for name, row in known_rows(arguments.results, code()).items()}
    missing = [case for case in wanted if case.name not in known and not arguments.table]
    say(f"{len(wanted)} robots, {len(wanted) - len(missing)} of them in {arguments.results} already")
    for row in measure(missing, arguments):
        keep(arguments.results, code(), row.to_json())
        known[row.name] = row
    rows = [known[case.name] for case in wanted if case.name in known]
    part = "" if len(rows) == len(wanted) else f" ({len(rows)} of {len(wanted)})"
    told = section(rows).markdown()
    print(f"# Arms{' (quick run)' if arguments.quick else ''}{part}\n\n{environment()}\n\n{told}")
    if not part and not arguments.quick and arguments.only == "*":
        write_section(told)
    if not arguments.table and arguments.only == "*":
        print(perfect_recordings.run(arguments.quick).markdown())


def measure(missing: list[ArmCase], arguments: argparse.Namespace) -> Iterator[ArmRow]:
    """Rows as they come."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    work = run_recording if arguments.record else run_case
    with ProcessPoolExecutor(arguments.jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(work, case, arguments.folder, arguments.limit): case for case in missing}
        for done, future in enumerate(as_completed(running), start=1):
            row = future.result()
            if row is not None:
                say(f"{done} of {len(missing)}: {row.name}: {row.outcome}: {row.message}")
                yield row


def run_recording(case: ArmCase, folder: Path, limit: float) -> None:
    """Only makes the recording."""
    if not (folder / case.name / "truth.json").is_file():
        record(case, folder / case.name)


def run_case(case: ArmCase, folder: Path, limit: float) -> ArmRow:
    """The recording, where it is not there yet, and the three commands in a folder of their own."""
    try:
        run_recording(case, folder, limit)
        source = folder / case.name
        truth = json.loads((source / "truth.json").read_text(encoding="utf-8"))
        with tempfile.TemporaryDirectory(prefix="jointscope-arm-") as place:
            for name in ("robot.urdf", "train.mcap"):
                shutil.copyfile(source / name, Path(place) / name)
            session = first_contact(Path(place), "robot.urdf", "train.mcap", limit)
            return judge(case.name, truth, session, Path(place))
    except Exception as err:  # a mistake of the benchmark shall not end a run of an hour; it stands in the table
        message = f"the benchmark itself: {type(err).__name__}: {err}"
        return ArmRow(case.name, case.variant, BROKEN, message=message)


@cache
def code() -> str:
    """Changes with the package and with the judge, so that no stale row is used."""
    package = Path(jointscope.graphs.__file__).parents[1]
    files = [path for room in ("robots", "factors", "graphs", "tools") for path in (package / room).rglob("*.py")]
    files += Path(__file__).parent.glob("arm_*.py")
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()[:12]


@cache
def simulation() -> str:
    """Changes with what makes the recordings."""
    pieces = ("bodies", "cases", "drives", "motion", "recording", "simulation", "urdf")
    content = b"".join(Path(__file__).with_name(f"arm_{piece}.py").read_bytes() for piece in pieces)
    return hashlib.sha256(content).hexdigest()[:12]


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python benchmarks/bench_arms.py",
        description="Brings robots as their makers ship them to init, info and calibrate, nothing edited; an "
        "interrupted run continues where it stopped. Example: bench_arms.py --only 'icub*' --jobs 1",
    )
    parser.add_argument("--quick", action="store_true", help=f"only {', '.join(QUICK)}")
    parser.add_argument("--only", default="*", metavar="NAME", help="only robots whose name matches, as 'ur*'")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes, each on one core; 2 by default")
    parser.add_argument(
        "--limit",
        type=float,
        default=LIMIT,
        metavar="S",
        help=f"computing time for a calibration [s]; {LIMIT:g} by default",
    )
    temporary = Path(tempfile.gettempdir())
    folder = temporary / f"jointscope-bench-arms-{simulation()}"
    parser.add_argument(
        "--folder", type=Path, default=folder, metavar="DIR", help="where the recordings are, or are made; kept"
    )
    results = temporary / "jointscope-bench-arms.jsonl"
    parser.add_argument("--results", type=Path, default=results, metavar="FILE", help=f"rows as JSON lines; {results}")
    parser.add_argument("--record", action="store_true", help="only make the recordings that are missing")
    parser.add_argument("--table", action="store_true", help="measure nothing, print the table of what is there")
    parser.add_argument("--list", action="store_true", help="only print the robots and how they are recorded")
    return parser.parse_args()


if __name__ == "__main__":
    main()
