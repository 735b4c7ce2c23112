# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised for recordings of real robots beside what is measured on parts that were held out.

Usage: python benchmarks/bench_real.py [SECTION...] [--json FILE]; the recordings lie in ../shared/data/real.
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

from real_recordings import REAL
from section_runs import run_sections

SECTIONS = ("real_hebi", "real_kr300", "real_xl330")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python benchmarks/bench_real.py", description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"any of {', '.join(SECTIONS)}; all by default")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures for machines, too")
    arguments = parser.parse_args()
    if not REAL.is_dir():
        parser.exit(message=f"skipped: {REAL} does not exist; the recordings do not come with the project\n")
    run_sections(
        "Recordings of real robots",
        arguments.sections or SECTIONS,
        lambda name: importlib.import_module(name).run(),
        False,
        arguments.json,
    )


if __name__ == "__main__":
    main()
