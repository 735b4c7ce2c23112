# SPDX-License-Identifier: BSD-3-Clause
"""Runs the sections of a benchmark one after the other: screen, JSON, and `docs/measured.md`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from measured_page import environment, write_section
from patience import say
from tables import Section


def run_sections(
    title: str, names: Sequence[str], run: Callable[[str], Section], quick: bool, json_file: Path | None
) -> None:
    """Measures and tells; what is measured is kept, whatever comes next.

    Args:
        title: heading of the screen.
        names: of the sections, as in the page.
        run: measures one.
        quick: short runs are printed, but do not go into the page.
        json_file: for machines; None where nobody asked for it.
    """
    surroundings = environment()
    print(f"# {title}{' (quick run)' if quick else ''}\n\n{surroundings}\n", flush=True)
    results: dict[str, Any] = {"environment": surroundings, "quick": quick, "sections": {}}
    for name in names:
        say(f"section {name}")
        started = time.perf_counter()
        section = run(name)
        seconds = time.perf_counter() - started
        print(f"{section.markdown()}\n({seconds:.0f} s)\n", flush=True)
        if not quick:
            write_section(section.markdown(), name)
        results["sections"][name] = section.to_json() | {"seconds": seconds}
        if json_file:
            json_file.write_text(json.dumps(results, indent=1), encoding="utf-8")
