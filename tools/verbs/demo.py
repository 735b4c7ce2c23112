# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope demo`: the whole story on a simulated Doggy, from bag to report, checked against the truth."""

from __future__ import annotations

import argparse
import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from jointscope.robots.errors import JointscopeError
from jointscope.tools.progress import Progress, progress_bar, reading
from jointscope.tools.result_files import ResultFiles, write_calibration, write_comparison
from jointscope.tools.whole_file import check_outputs, write_json

EXAMPLE = """example:
  jointscope demo -o demo"""

ROBOT = "doggy"
MOVES_SECONDS = 10.0  # [s]
FRICTION = "smooth"  # as the robot file has it; with "dry" the simulation holds an effect that the model lacks
ALLOWED_ERROR = 0.01  # a parameter within 1 % of the truth is called found


def add_parser(subparsers: Any) -> None:
    """Adds the verb to the command line."""
    parser = subparsers.add_parser(
        "demo",
        help="the whole story on a simulated Doggy, from bag to report",
        description="Simulates a recording, calibrates from it, checks the result against the truth and on another "
        "recording, and writes everything into a folder.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, default=Path("demo"), help="folder; default demo")
    parser.add_argument("--seconds", metavar="S", type=float, default=20.0, help="of the calibration recording [s]")
    parser.add_argument("--seed", metavar="N", type=int, default=1, help="of the simulated robot; default 1")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was found as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Tells the story in a hidden folder and shows it under its name only when it is complete."""
    folder: Path = args.output
    if folder.exists() and not folder.is_dir():
        raise JointscopeError(f"cannot write into {folder}: it is a file; expected a folder, or a new name")
    check_outputs([folder / "doggy_calibrated.yaml" if folder.is_dir() else folder, args.json])
    try:
        with tempfile.TemporaryDirectory(prefix=f".{folder.name}.", dir=folder.parent) as hidden:
            found = _Story(Path(hidden), folder, args.seconds, args.seed).tell()
            folder.mkdir(exist_ok=True)
            for file in sorted(Path(hidden).iterdir()):
                os.replace(file, folder / file.name)
    except OSError as err:
        raise JointscopeError(f"cannot write into {folder}: {err.strerror or err}") from err
    if args.json is not None:
        write_json(args.json, found)
    print(_where_to_look(folder))
    return 0


class _Story:
    """The steps of the demo.

    Args:
        hidden: where files are written.
        folder: where the user will find them.
        seconds: length of the calibration recording [s].
        seed: of the simulated robot.
    """

    def __init__(self, hidden: Path, folder: Path, seconds: float, seed: int):
        from jointscope.robots.robot_file import load_robot

        self.hidden, self.folder, self.seconds, self.seed = hidden, folder, seconds, seed
        self.robot = load_robot(ROBOT)

    def tell(self) -> dict[str, Any]:
        """Runs all steps and returns what they found, for JSON."""
        _say("1. A recording. MuJoCo drives a Doggy whose parameters the estimator does not know.")
        truth = self._simulate("calibration", self.seconds)
        _say("\n2. The calibration: every sample is a state, the parameters are shared by all.")
        calibration = self._calibrate()
        _say("\n3. Against the truth of the simulation:")
        _say(_against_truth(calibration, truth))
        _say("\n4. Another motion of the same robot, which the calibration has not seen.")
        self._simulate("moves", MOVES_SECONDS)
        _say("")
        comparison = self._compare()
        return {"calibration": calibration.to_json(), "truth": truth, "comparison": comparison.to_json()}

    def _simulate(self, motion: str, seconds: float) -> dict[str, Any]:
        """Writes a bag and the truth beside it; returns the true parameters."""
        from jointscope.tools.bags import write_bag
        from jointscope.tools.simulator import simulate

        options = f"--motion {motion} --seconds {seconds:g} --seed {self.seed} --friction {FRICTION}"
        self._command(f"simulate {ROBOT} -o {{}}/{motion}.mcap {options}")
        with progress_bar() as progress:
            simulation = simulate(
                self.robot,
                motion,
                seconds,
                self.seed,
                friction=FRICTION,
                progress=lambda share: progress("simulating", share),
            )
            write_bag(self.hidden / f"{motion}.mcap", simulation.recording, self.robot)
        write_json(self.hidden / f"{motion}.truth.json", simulation.truth)
        count = simulation.recording.sample_count
        _say(f"{self.folder}/{motion}.mcap: {count:,} messages; what is true stands in {motion}.truth.json")
        return dict(simulation.truth["parameters"])

    def _calibrate(self) -> Any:
        from jointscope.graphs.calibrate import calibrate
        from jointscope.tools.calibration_text import calibration_text

        self._command(
            f"calibrate {ROBOT} {{0}}/calibration.mcap -o {{0}}/doggy_calibrated.yaml "
            "--report {0}/calibration.html --rrd {0}/calibration.rrd"
        )
        with progress_bar() as progress:
            result = calibrate(self.robot, [self._read("calibration", progress)], progress=progress)
            files = ResultFiles(
                robot=self.hidden / "doggy_calibrated.yaml",
                report=self.hidden / "calibration.html",
                rrd=self.hidden / "calibration.rrd",
            )
            write_calibration(result, files)
        _say(calibration_text(result))
        return result

    def _compare(self) -> Any:
        from jointscope.graphs.compare import compare
        from jointscope.robots.robot_file import load_robot
        from jointscope.tools.comparison_text import comparison_text

        self._command(
            f"compare {ROBOT} {{0}}/doggy_calibrated.yaml {{0}}/moves.mcap "
            "--report {0}/comparison.html --rrd {0}/comparison.rrd"
        )
        # read back from its file, as a user would
        robots = {ROBOT: self.robot, "doggy_calibrated": load_robot(self.hidden / "doggy_calibrated.yaml")}
        with progress_bar() as progress:
            result = compare(robots, self._read("moves", progress), progress=progress)
            write_comparison(
                result, ResultFiles(report=self.hidden / "comparison.html", rrd=self.hidden / "comparison.rrd")
            )
        _say(comparison_text(result))
        return result

    def _read(self, name: str, progress: Progress) -> Any:
        from jointscope.tools.bags import read_recording

        bag = f"{name}.mcap"
        recording = read_recording(self.hidden / bag, self.robot, reading(Path(bag), progress))
        return replace(recording, path=str(self.folder / bag))

    def _command(self, text: str) -> None:
        """Prints what the user would type."""
        _say(f"   $ jointscope {text.format(self.folder)}\n")


def _against_truth(result: Any, truth: dict[str, Any]) -> str:
    """Table of true and found dynamic parameters, and a sentence."""
    from jointscope.tools.report.numbers import significant, with_sigma
    from jointscope.tools.text_table import text_table

    rows, errors, distances = [], [], []
    for parameter in result.parameters:
        true = truth.get(parameter.name)
        if not isinstance(true, float) or true == 0.0:
            continue
        errors.append(abs(parameter.value / true - 1.0))
        value, sigma = with_sigma(parameter.value, parameter.sigma)
        distances.append(abs(parameter.value - true) / parameter.sigma if parameter.sigma > 0 else float("nan"))
        cells = [parameter.name, significant(true, 6), value, sigma, parameter.unit]
        rows.append([*cells, f"{errors[-1]:.3%}", f"{distances[-1]:.1f}"])
    head = ["parameter", "truth", "found", "± sigma", "unit", "error", "in sigmas"]
    good, honest = sum(e <= ALLOWED_ERROR for e in errors), sum(d <= 2.0 for d in distances)
    sentence = (
        f"Of {len(errors)} parameters {good} are within {ALLOWED_ERROR:.0%} of the truth (largest error "
        f"{max(errors):.2%}) and {honest} within two of their own sigmas (95 % are expected to be)."
    )
    return f"{text_table(head, rows, '<>>><>>')}\n\n{sentence}"


def _where_to_look(folder: Path) -> str:
    return f"""
5. Look at it:
   {folder}/calibration.html        is this calibration good? (open it in a browser)
   {folder}/comparison.html         start and calibrated model on the unseen motion
   {folder}/doggy_calibrated.yaml   the robot file with values and sigmas
   $ jointscope view {folder}/calibration.rrd"""


def _say(text: str) -> None:
    print(text, flush=True)
