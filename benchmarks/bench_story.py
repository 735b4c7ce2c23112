# SPDX-License-Identifier: BSD-3-Clause
"""The story of the README: three hidden effects that `discover` finds one by one; its picture and its figures.

Usage: python benchmarks/bench_story.py [--quick]
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
from pathlib import Path
from typing import Any

from measured_page import ROOT, environment, write_section
from tables import Section, Table

from jointscope.tools.command_line import main as jointscope
from jointscope.tools.presentation.numbers import significant

HIDDEN = (
    "load_dependent_friction@joint2:coefficient=0.25",
    "cogging@joint1:cos=0.5,sin=0.4,order=42.092",
    "backlash@joint3:half_gap=0.01",
)
SECONDS = 20.0  # [s]
PICTURE = ROOT / "docs" / "pictures" / "story.svg"


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python benchmarks/bench_story.py", description="draws the picture of the README and measures its figures"
    )
    parser.add_argument("--quick", action="store_true", help="one hidden effect, two minutes; writes neither file")
    quick = parser.parse_args().quick
    print(f"# Story{' (quick run)' if quick else ''}\n\n{environment()}\n", flush=True)
    with tempfile.TemporaryDirectory(prefix="jointscope-story-") as folder:
        found = _told(Path(folder) / "story", HIDDEN[:1] if quick else HIDDEN, 8.0 if quick else SECONDS)
        section = story_section(found["discovery"], HIDDEN[:1] if quick else HIDDEN).markdown()
        print(section)
        if not quick:
            write_section(section)  # first: the commit of a tree with another picture would be one "with changes"
            shutil.copyfile(Path(folder) / "story" / "story.svg", PICTURE)


def story_section(discovery: dict[str, Any], hidden: tuple[str, ...]) -> Section:
    """The errors step by step, as the picture shows them.

    Args:
        discovery: JSON of `discover`.
        hidden: ID@OWNER:values of what was simulated.
    """
    section = Section(
        "The story of the README",
        f"`jointscope demo` with {SECONDS:g} s of a Doggy that hides {', '.join(f'`{effect}`' for effect in hidden)}. "
        "Errors are those of predictions 0.1 s ahead, in sensor sigmas; the floor is what noise alone would leave.",
    )
    rows = [
        (
            f"+ {step['added']}" if step["added"] else f"- {step['removed']}" if step["removed"] else "base model",
            *(significant(step[key], 3) for key in ("train_error", "heldout_error", "floor")),
        )
        for step in discovery["steps"]
    ]
    section.tables.append(Table("Step by step", ("step", "training", "held out", "floor"), rows))
    return section


def _told(folder: Path, hidden: tuple[str, ...], seconds: float) -> dict[str, Any]:
    """Runs the verb and returns its JSON."""
    told = folder.with_suffix(".json")
    effects = [word for effect in hidden for word in ("--effect", effect)]
    code = jointscope(["demo", "-o", str(folder), "--seconds", f"{seconds:g}", *effects, "--json", str(told)])
    if code:
        raise SystemExit(code)
    found: dict[str, Any] = json.loads(told.read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    main()
