# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised for recordings of real robots beside what is measured on parts that were held out.

Usage: python benchmarks/bench_real.py [SECTION...] [--json FILE]; the recordings lie in ../shared/data/real.
"""

from __future__ import annotations

import argparse
import importlib
import json
import time
from pathlib import Path
from typing import Any

from bench import environment
from patience import say
from real_recordings import REAL
from tables import Section

SECTIONS = ("real_hebi", "real_kr300", "real_xl330")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python benchmarks/bench_real.py", description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"any of {', '.join(SECTIONS)}; all by default")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures for machines, too")
    arguments = parser.parse_args()
    if not REAL.is_dir():
        parser.exit(message=f"skipped: {REAL} does not exist; the recordings do not come with the project\n")
    surroundings = environment()
    print(f"# Recordings of real robots\n\n{surroundings}\n", flush=True)
    results: dict[str, Any] = {"environment": surroundings, "sections": {}}
    for name in arguments.sections or SECTIONS:
        say(f"section {name}")
        started = time.perf_counter()
        section: Section = importlib.import_module(name).run()
        print(f"{section.markdown()}\n({time.perf_counter() - started:.0f} s)\n", flush=True)
        results["sections"][name] = section.to_json()
        if arguments.json:
            arguments.json.write_text(json.dumps(results, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
