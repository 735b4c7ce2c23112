# SPDX-License-Identifier: BSD-3-Clause
"""Hides effects in simulated recordings and lets `discover` find them; the table goes into docs/measured.md.

Usage: python benchmarks/bench_discovery.py [--quick] [--only PATTERN] [--jobs N] [--results FILE] [--table] [--list]
       [--seed N]

The table of one whole kind, as `--only "spring:*"`, goes there, too, as a section of its own.
"""

from __future__ import annotations

import argparse
import fnmatch
import hashlib
import multiprocessing
import os
import random
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import cache
from pathlib import Path

from discovery import kind_section, section
from discovery_case import run_case
from discovery_row import Row
from hidden_effects import KINDS, AnyCase, cases, tenth
from kept_rows import keep, known_rows
from measured_page import environment, write_section
from patience import say

import jointscope.graphs

ORDER = 3  # seed of the order of the cases; no result depends on it
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> None:
    arguments = _parse()
    every = cases(arguments.seed)
    wanted = tenth(every) if arguments.quick else every
    wanted = [case for case in wanted if fnmatch.fnmatch(f"{case.kind}: {case.name}", f"*{arguments.only}*")]
    if arguments.list:
        print("\n".join(f"{case.kind}: {case.name}" for case in wanted))
        return
    results: Path = arguments.results
    known = {name: Row.of_json(row) for name, row in known_rows(results, code()).items()}
    missing = [case for case in wanted if case.name not in known and not arguments.table]
    say(f"{len(wanted)} cases, {sum(case.name in known for case in wanted)} of them in {results} already")
    # in a random order, so that an interrupted table is a fair part of every kind
    random.Random(ORDER).shuffle(missing)
    for row in measure(missing, arguments.jobs):
        keep(results, code(), row.to_json())
        known[row.name] = row
    rows = [known[case.name] for case in wanted if case.name in known]
    part = "" if len(rows) == len(wanted) else f" ({len(rows)} of {len(wanted)} cases)"
    kind = arguments.only.removesuffix(":*")
    told = (kind_section(kind, rows) if kind in KINDS else section(rows)).markdown()
    print(f"# Discovery{' (quick run)' if arguments.quick else ''}{part}\n\n{environment()}\n\n{told}")
    if part or arguments.quick:
        return
    if kind in KINDS:
        write_section(told, f'--only "{arguments.only}"' + (f" --seed {arguments.seed}" if arguments.seed else ""))
    elif not arguments.only and not arguments.seed:
        write_section(told)


def measure(missing: list[AnyCase], jobs: int) -> Iterator[Row]:
    """Rows as they come; each process has one core, where the linear algebra of several would fight for all."""
    os.environ.update(dict.fromkeys(THREADS, "1"))
    began = time.perf_counter()
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(run_case, case): case for case in missing}
        for done, future in enumerate(as_completed(running), start=1):
            case = running[future]
            try:
                row = future.result()
            except BrokenProcessPool:
                raise  # a process was killed, and the others with it: nothing was measured
            except Exception as err:  # a bug shall not end a run of hours; it stands in the table
                row = Row(case.name, case.kind, case.truth, error=f"{type(err).__name__}: {err}")
            left = (time.perf_counter() - began) / done * (len(missing) - done)
            say(
                f"{done} of {len(missing)}, {left / 60:.0f} min left; {row.name}: {row.error or row.accepted or 'none'}"
            )
            yield row


@cache
def code() -> str:
    """Changes with the package and with the table, so that no stale row is used."""
    package = Path(jointscope.graphs.__file__).parents[1]
    files = [p for room in ("robots", "factors", "graphs", "tools/simulator") for p in (package / room).rglob("*.py")]
    files += [
        Path(__file__).with_name(name)
        for name in ("hidden_effects.py", "setting_arms.py", "spring_axes.py", "hidden_axes.py")
    ]
    content = b"".join(path.read_bytes() for path in sorted(files))
    return hashlib.sha256(content).hexdigest()[:12]


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python benchmarks/bench_discovery.py",
        description="Hides effects in simulated recordings and lets `discover` find them; an interrupted run continues "
        "where it stopped. Example: bench_discovery.py --only bearing --jobs 2",
    )
    parser.add_argument("--quick", action="store_true", help="about a tenth of the table, some of every kind")
    parser.add_argument(
        "--only", default="", metavar="PATTERN", help="only cases whose name matches, as 'pair:*cogging'"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="added to all seeds; 0 is the table")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes, each on one core; 2 by default")
    default = Path(tempfile.gettempdir()) / "jointscope-bench-discovery.jsonl"
    parser.add_argument("--results", type=Path, default=default, metavar="FILE", help=f"rows as JSON lines; {default}")
    parser.add_argument("--table", action="store_true", help="measure nothing, print the table of what is there")
    parser.add_argument("--list", action="store_true", help="only print the names of the cases")
    return parser.parse_args()


if __name__ == "__main__":
    main()
