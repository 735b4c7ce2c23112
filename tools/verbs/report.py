# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope report`: writes a page for the browser that shows how well models predict a recording."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointscope.tools.verbs import compare

DESCRIPTION = "Writes the report of `jointscope compare`."
EXAMPLE = """example:
  jointscope report doggy doggy_calibrated.yaml moves.mcap -o comparison.html

`calibrate`, `diagnose` and `discover` write reports of their own: `jointscope diagnose ... --report F.html`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    compare.add_models_and_bag(parser)
    parser.add_argument("-o", "--output", dest="report", metavar="F.html", type=Path, required=True, help="the report")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result as JSON")
    parser.set_defaults(rrd=None, figures=None)


def run(args: argparse.Namespace) -> int:
    """Does what `jointscope compare` does."""
    return compare.run(args)
