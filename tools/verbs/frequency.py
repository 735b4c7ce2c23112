# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope frequency`: estimates the frequency response matrix of any system, with its covariances."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path

from jointscope.robots.errors import RecordingError
from jointscope.tools.terminal.progress import progress_bar
from jointscope.tools.verb_parts.result_files import ResultFiles, add_result_options, write_report
from jointscope.tools.writing.whole_file import check_outputs, whole_file, write_json

DESCRIPTION = "Estimates frequency responses from recordings of periodic excitation, one for each bag."
EXAMPLE = """example:
  jointscope frequency frequency_P1 frequency_P3 --report frf.html
  jointscope frequency bench.mcap --from /drive:effort --to /joint_states:velocity:motor,load -o frf.npz

How it was excited is read from excitation.yaml beside the bag, or found from the recording (docs/frequency.md)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds what the verb takes."""
    parser.add_argument("bags", metavar="BAG", nargs="+", type=Path, help="a .bag, .mcap, .db3 or a ROS 2 bag folder")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, help="write the matrices as .npz or .csv")
    parser.add_argument(
        "--from",
        dest="source",
        default="",
        metavar="SIGNAL",
        help="inputs, TOPIC:FIELD[:NAME,...]; default: /joint_states:effort of the joints in /motor_command",
    )
    parser.add_argument(
        "--to", dest="target", default="", metavar="SIGNAL", help="outputs; default: /joint_states:position of these"
    )
    parser.add_argument(
        "--excitation",
        type=Path,
        metavar="FILE",
        help="describes the excitation; default: excitation.yaml beside the bag",
    )
    add_result_options(parser, viewer=False)


def run(args: argparse.Namespace) -> int:
    """Estimates, writes the files, and says what was found."""
    if args.output is not None and args.output.suffix.lower() not in (".npz", ".csv"):
        raise RecordingError(f"{args.output}: expected a name that ends with .npz or .csv")
    files = ResultFiles(args.report, json=args.json, figures=args.figures)
    check_outputs([args.output, *files.all], inputs=[*args.bags, *filter(None, [args.excitation])])
    from jointscope.graphs.responses.find_excitation import NoPeriodsError
    from jointscope.graphs.responses.measured_response import MeasuredResponse
    from jointscope.tools.bags.read_signals import excitation_of, read_signals
    from jointscope.tools.report.responses_report import responses_report
    from jointscope.tools.terminal.responses_text import response_text

    found = []
    with progress_bar() as progress:
        for i, bag in enumerate(args.bags):
            progress(f"reading {bag.name}", i / len(args.bags))
            signals, drive = read_signals(bag, args.source, args.target, file=args.excitation)
            try:
                excitation = excitation_of(bag, signals, drive, args.excitation)
            except NoPeriodsError:
                excitation = None
            found.append(MeasuredResponse.of(signals, excitation))
    with ExitStack() as stack:
        if args.output is not None:
            from jointscope.tools.export.response_files import write_responses

            write_responses(stack.enter_context(whole_file(args.output)), found, args.output.suffix.lower())
        write_report(stack, files, lambda: responses_report(found))
        if args.json is not None:
            write_json(stack.enter_context(whole_file(args.json)), {"responses": [one.to_json() for one in found]})
    print("\n\n".join(map(response_text, found)))
    files.tell(args.output)
    return 0
