# SPDX-License-Identifier: BSD-3-Clause
"""Prints what was promised beside what is measured, as markdown.

Usage: python benchmarks/bench.py [SECTION...] [--quick] [--json FILE]
"""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import json
import os
import platform
import time
from pathlib import Path
from typing import Any

from patience import say
from tables import Section

SECTIONS = ("accuracy", "speed", "honest_sigmas", "reading")
PACKAGES = ("jointscope", "numpy", "scipy", "gtsam", "pin", "mujoco", "numba", "rosbags")


def main() -> None:
    arguments = _parse()
    surroundings = environment()
    print(f"# Benchmark{' (quick run)' if arguments.quick else ''}\n\n{surroundings}\n", flush=True)
    results: dict[str, Any] = {"environment": surroundings, "quick": arguments.quick, "sections": {}}
    for name in arguments.sections or SECTIONS:
        say(f"section {name}")
        started = time.perf_counter()
        section: Section = importlib.import_module(name).run(arguments.quick)
        seconds = time.perf_counter() - started
        print(f"{section.markdown()}\n({seconds:.0f} s)\n", flush=True)
        results["sections"][name] = section.to_json() | {"seconds": seconds}
        if arguments.json:  # after every section: what is measured is kept, whatever comes next
            arguments.json.write_text(json.dumps(results, indent=1), encoding="utf-8")


def environment() -> str:
    """Cores, load, Python and package versions in one line."""
    versions = []
    for package in PACKAGES:
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{package} not installed")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    # other work on the machine makes every time below longer; the load tells
    load = f"load {os.getloadavg()[0]:.1f} at the start, " if hasattr(os, "getloadavg") else ""
    return f"{cores} cores, {load}{platform.machine()}, Python {platform.python_version()}, {', '.join(versions)}"


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
