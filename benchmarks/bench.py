# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised beside what is measured, and writes it into docs/measured.md.

Usage: python benchmarks/bench.py [SECTION...] [--quick] [--json FILE]
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

from section_runs import run_sections

SECTIONS = ("accuracy", "speed", "honest_sigmas", "reading", "cluster")


def main() -> None:
    arguments = _parse()
    run_sections(
        "Benchmark",
        arguments.sections or SECTIONS,
        lambda name: importlib.import_module(name).run(arguments.quick),
        arguments.quick,
        arguments.json,
    )


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python benchmarks/bench.py",
        description="Prints what was promised beside what is measured; example: bench.py speed reading --quick",
    )
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"any of {', '.join(SECTIONS)}; all by default")
    parser.add_argument("--quick", action="store_true", help="short recordings, a few minutes in all")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures for machines, too")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.sections if name not in SECTIONS]
    if unknown:
        parser.error(f"unknown section {unknown[0]!r}; expected {', '.join(SECTIONS)}")
    return arguments


if __name__ == "__main__":
    main()
