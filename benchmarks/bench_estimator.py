# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised of the fixed-lag estimator beside what is measured, and writes it into docs/measured.md.

Usage: python benchmarks/bench_estimator.py [SECTION...] [--quick] [--minutes M] [--json FILE]
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from section_runs import run_sections
from tables import Section

SECTIONS = ("latency", "accuracy", "consistency", "trouble", "loop")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
MINUTES = 10.0


def main() -> None:
    arguments = _parse()
    os.environ.update(dict.fromkeys(THREADS, "1"))  # read when the processes below load numpy
    run_sections(
        "Estimator",
        arguments.sections or SECTIONS,
        lambda name: _measured(name, arguments.quick, arguments.minutes),
        arguments.quick,
        arguments.json,
    )


def run(name: str, quick: bool, minutes: float) -> Section:
    """One section."""
    module = importlib.import_module(f"estimator_{name}")
    return module.run_section(quick, minutes) if name == "latency" else module.run_section(quick)


def _measured(name: str, quick: bool, minutes: float) -> Section:
    """Each section has a process of its own: memory and garbage of one are not the other's."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(run, name, quick, minutes).result()


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python benchmarks/bench_estimator.py",
        description="Prints what was promised of the estimator beside what is measured; a quarter of an hour on one "
        "core that has nothing else to do. Example: bench_estimator.py latency --minutes 60",
    )
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"any of {', '.join(SECTIONS)}; all by default")
    parser.add_argument("--quick", action="store_true", help="few and short recordings, two minutes in all")
    parser.add_argument(
        "--minutes", type=float, default=MINUTES, metavar="M", help=f"length of the long replay; {MINUTES:g} by default"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures for machines, too")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.sections if name not in SECTIONS]
    if unknown:
        parser.error(f"unknown section {unknown[0]!r}; expected {', '.join(SECTIONS)}")
    return arguments


if __name__ == "__main__":
    main()
