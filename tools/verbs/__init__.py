# SPDX-License-Identifier: BSD-3-Clause
"""The verbs of the command line, one per file: `add_parser(subparsers)` and `run(args) -> int`."""
