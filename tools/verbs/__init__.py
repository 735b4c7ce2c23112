# SPDX-License-Identifier: BSD-3-Clause
"""The verbs of the command line, one per file: DESCRIPTION, EXAMPLE, `add_arguments(parser)`, `run(args) -> int`."""
