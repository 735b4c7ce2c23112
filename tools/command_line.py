# SPDX-License-Identifier: BSD-3-Clause
"""The command `jointscope`: finds the verbs, runs one, and turns every known trouble into one line and exit code 1.

A verb is a module in `tools/verbs/`; its name is the file's with hyphens, its one-line help the first line of its
docstring.
Only the verb that runs is imported, so that `jointscope --help` is there at once.
"""

from __future__ import annotations

import argparse
import ast
import functools
import importlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import jointscope
from jointscope.robots.errors import JointscopeError
from jointscope.robots.outside_modules import trouble_with_modules
from jointscope.tools.writing.protected_files import check_protected

VERBS = Path(__file__).parent / "verbs"
TRACEBACK = "JOINTSCOPE_TRACEBACK"
EXAMPLE = """examples:
  jointscope demo
  jointscope info calibration.mcap --robot doggy
  jointscope calibrate doggy calibration.mcap -o doggy_calibrated.yaml --report report.html
  jointscope compare doggy doggy_calibrated.yaml moves.mcap
  jointscope discover doggy train.mcap --holdout test.mcap -o found.yaml --report discovery.html

`jointscope VERB --help` explains a verb."""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line.

    Args:
        argv: arguments without the program's name; those of the process by default.

    Returns:
        0, or 1 after an error, which stands as one line on standard error. Wrong usage exits with 2.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal without ± still shows the number
    try:
        args = _parser(arguments).parse_args(arguments)
        check_protected(args)
        code = int(args.run(args))
        sys.stdout.flush()  # a full disk or a closed pipe shows here, not when Python shuts down
        return code
    except (KeyboardInterrupt, Exception) as err:
        if os.environ.get(TRACEBACK) == "1":
            raise
        return _complain(err)


def verbs() -> dict[str, str]:
    """All verbs: name and one-line help."""
    return {
        path.stem.replace("_", "-"): _summary(path) for path in sorted(VERBS.glob("*.py")) if path.stem != "__init__"
    }


class _Parser(argparse.ArgumentParser):
    """No abbreviations: --effect must not be taken for --effects where a verb has only that.

    Attributes:
        verb: what to add to the program's name to get help, for what only the outer parser notices.
    """

    verb = ""

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **{"allow_abbrev": False, **kwargs})

    def error(self, message: str) -> NoReturn:
        """Says in one line what is wrong with the usage, and where the right one stands; exit code 2."""
        self.exit(2, f"{self.prog}: error: {' '.join(message.split())}; usage: {self.prog}{self.verb} --help\n")


def _parser(arguments: Sequence[str]) -> argparse.ArgumentParser:
    parser = _Parser(
        prog="jointscope",
        description="Calibrates the dynamics of flexible-joint robots from rosbags and shows what the model cannot "
        "explain.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    version = f"jointscope {jointscope.__version__}" if "--version" in arguments else ""  # to look it up costs time
    parser.add_argument("--version", action="version", version=version)
    subparsers = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    asked_for = next((argument for argument in arguments if not argument.startswith("-")), None)
    for name, summary in verbs().items():
        if name == asked_for:
            parser.verb = f" {name}"
            add_verb(subparsers, name)
        else:
            subparsers.add_parser(name, help=summary)
    return parser


def add_verb(subparsers: Any, name: str) -> None:
    """Adds a verb with all that it takes."""
    module = importlib.import_module(f"jointscope.tools.verbs.{name.replace('-', '_')}")
    parser = subparsers.add_parser(
        name,
        help=verbs()[name],
        description=module.DESCRIPTION,
        epilog=module.EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=module.run)
    module.add_arguments(parser)


@functools.cache
def _summary(path: Path) -> str:
    """What follows the colon in the first line of a verb's docstring."""
    doc = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return doc.partition("\n")[0].partition(": ")[2].rstrip(".")


def _complain(err: BaseException) -> int:
    """Says what went wrong in one line; returns the exit code."""
    if isinstance(err, BrokenPipeError):
        # whoever read the output has seen enough; Python would complain when it flushes at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    print(f"jointscope: error: {_one_line(err)}", file=sys.stderr)
    return 1


def _one_line(err: BaseException) -> str:
    if isinstance(err, KeyboardInterrupt):
        return "interrupted; nothing was written"
    text = " ".join(str(err).split())
    if isinstance(err, JointscopeError):
        return text
    if isinstance(err, OSError):
        place = f"{err.filename}: " if err.filename else ""
        return f"{place}{err.strerror or text}"
    if isinstance(err, MemoryError):
        return "out of memory; calibrate from a shorter recording"
    if isinstance(err, ImportError | AttributeError | SyntaxError):
        # it may be another project's module, missing or replaced
        trouble = trouble_with_modules()
        if trouble:
            return trouble
    return f"this is a bug in jointscope: {type(err).__name__}: {text}; {TRACEBACK}=1 shows where"


if __name__ == "__main__":
    sys.exit(main())
