# SPDX-License-Identifier: BSD-3-Clause
"""How near a calibration comes to the truth, on recordings that this project's simulator did not make."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from deviations import UNOBSERVABLE, Deviation, deviations, nearest_rotation
from patience import say
from tables import Section, Table, answer

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.comparison.compare import compare_model
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording

DATA = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "doggy" / "clean"

PERCENT = 1.0  # [%]
SPRING_PERCENT = 0.5  # [%] stiffness and damping
BIAS = 1e-4  # [rad/s]
ROTATION = 0.1  # [deg]
HELD_OUT = 1.05  # times the error of the true parameters
TRUTH = "true parameters, noise of doggy as calibrated"
SETTINGS = {"doggy": "doggy", "doggy_paper": "doggy_paper, the literal choices of the paper"}


def run(quick: bool) -> Section:
    """Calibrates on the training recording, looks at the truth and at the test recording; `quick` changes nothing."""
    section = Section(
        "Accuracy",
        "Clean Doggy recordings that this project's simulator did not make: 16 s to calibrate with and 8 s held out.",
    )
    if not (DATA / "truth.json").is_file():
        section.notes.append("Skipped: the recordings are not there; they are expected in ../shared/data/doggy/clean.")
        return section
    told = json.loads((DATA / "truth.json").read_text(encoding="utf-8"))
    train, test = (read_recording(DATA / name, load_robot("doggy")) for name in ("train", "test"))
    results = {}
    for name, words in SETTINGS.items():
        say(f"accuracy: calibrating {name}")
        robot = load_robot(name)
        try:
            found = calibrate(robot, [train])
        except JointscopeError as err:
            section.notes.append(f"{words}: the calibration ends with an error: {err}")
            continue
        results[name] = found
        _report(section, name, found, deviations(found.robot, truth_of(robot, told["train"])))
    if "doggy" in results:
        _held_out(section, results, truth_of(results["doggy"].start, told["test"]), test)
    return section


def truth_of(robot: Robot, told: Mapping[str, Any]) -> dict[str, Any]:
    """The truth of a recording by the full names of the robot file."""
    drive = told["params"]
    values = [drive["kpwm"], drive["kmi"], drive["b"], *drive["mu"], *drive["ks"], *drive["ds"]]
    truth: dict[str, Any] = dict(zip(robot.parameters, values, strict=True))
    matrices = ("R_imu1_body1", "R_imu2_body3")
    for gyro, bias, matrix in zip(robot.gyros, ("bias1", "bias2"), matrices, strict=True):
        truth[f"{gyro.name}.bias"] = told[bias]
        truth[f"{gyro.name}.R_imu_body"] = nearest_rotation(told[matrix])
    return truth


def _report(section: Section, name: str, result: CalibrationResult, found: Sequence[Deviation]) -> None:
    """Promises for the model that makes them, the same figures without promise for the paper's."""
    promised = name == "doggy"
    dynamics = [d for d in found if d.kind == "dynamics"]
    springs = [d for d in dynamics if d.name.endswith((".stiffness", ".damping"))]
    groups = (
        ("largest error of the drives' parameters", [d for d in dynamics if d not in springs], PERCENT),
        ("largest error of stiffness and damping", springs, SPRING_PERCENT),
    )
    for what, group, limit in groups:
        worst = max(group, key=lambda d: abs(d.percent))
        size = abs(worst.percent)
        measured = f"{size:.3f} % ({worst.name})"
        section.promise(f"{name}: {what}", f"{limit:g} %" * promised, measured, size < limit if promised else None)
    bias = max(abs(d.error) for d in found if d.kind == "bias")
    section.promise(
        f"{name}: largest error of a bias",
        f"{BIAS:g} rad/s" * promised,
        f"{bias:.1e} rad/s",
        bias < BIAS if promised else None,
    )
    angle = max(np.degrees(abs(d.error)) for d in found if d.kind == "rotation")
    measured = f"{angle:.4f} deg"
    section.promise(
        f"{name}: largest error of a mounting rotation*",
        f"{ROTATION:g} deg" * promised,
        measured,
        angle < ROTATION if promised else None,
    )
    section.tables.append(_table(SETTINGS[name], found, promised))
    if promised:
        section.notes.append(
            f"* without {UNOBSERVABLE}, the yaw of imu1 about its own joint's axis: {_yaw_note(result)}"
        )
    by_name = {d.name: {"value": d.value, "truth": d.truth, "sigma": d.sigma, "unit": d.unit} for d in found}
    section.numbers[name] = {"numbers": by_name, "wall_seconds": result.wall_seconds}


def _yaw_note(result: CalibrationResult) -> str:
    """What the calibration itself says about the yaw."""
    yaw = next(p for p in result.parameters if p.name == UNOBSERVABLE)
    said = f'"{yaw.note}"' if yaw.note else "nothing"
    sigma = f"{np.degrees(yaw.sigma):.1f} deg"
    return f"no recording with a rigid bearing shows it. The calibration says {said}, sigma {sigma}."


def _table(words: str, found: Sequence[Deviation], promised: bool) -> Table:
    rows = []
    for d in found:
        if d.kind == "dynamics":
            limit = SPRING_PERCENT if d.name.endswith((".stiffness", ".damping")) else PERCENT
            cells = (f"{d.truth:.4f}", f"{d.value:.4f}", d.unit, f"{d.percent:+.3f} %")
            met = abs(d.percent) < limit
        elif d.kind == "bias":
            cells = (f"{d.truth:+.6f}", f"{d.value:+.6f}", d.unit, f"{d.error:+.1e} rad/s")
            met = abs(d.error) < BIAS
        else:
            cells = ("", "", "", f"{np.degrees(d.error):+.4f} deg")
            met = bool(np.degrees(abs(d.error)) < ROTATION)
        rows.append((d.name, *cells, f"{d.z:+.2f}", answer(met) if promised else ""))
    head = ("number", "truth", "calibrated", "unit", "error", "error in sigmas", "met?")
    return Table(f"{words}, against the truth", head, rows)


def _held_out(
    section: Section, results: Mapping[str, CalibrationResult], truth: Mapping[str, Any], test: Recording
) -> None:
    """`error` of every calibrated robot on the test recording, and of the truth."""
    robots = {f"{name}, calibrated": result.robot for name, result in results.items()}
    robots[TRUTH] = _true_robot(results["doggy"], truth)
    errors = {}
    for label, robot in robots.items():
        say(f"accuracy: held-out error, {label}")
        try:
            model = compare_model(label, robot, test)
        except JointscopeError as err:
            section.notes.append(f"{label}: the comparison ends with an error: {err}")
            continue
        errors[label] = {"error": model.error, "floor": model.floor}
    ratio = errors["doggy, calibrated"]["error"] / errors[TRUTH]["error"]
    section.promise(
        "held-out error over that of the true parameters", f"at most {HELD_OUT:g}", f"{ratio:.4f}", ratio <= HELD_OUT
    )
    rows = [(label, f"{e['error']:.4f}", f"{e['floor']:.4f}") for label, e in errors.items()]
    section.tables.append(Table("Held-out error 0.1 s ahead, in sensor sigmas", ("parameters", "error", "floor"), rows))
    section.numbers["held_out"] = errors


def _true_robot(result: CalibrationResult, truth: Mapping[str, Any]) -> Robot:
    """The true parameters and mounting under the calibrated process noise.

    Every parameter gets some sigma, which is what marks a robot as calibrated: its noise is then not estimated anew,
    and both robots are judged by the same filter.
    """
    values = {name: float(truth[name]) for name in result.robot.parameters}
    rotations = {g.name: replace(g, R_imu_body=truth[f"{g.name}.R_imu_body"]) for g in result.robot.gyros}
    robot = result.robot.with_values(values).with_sensors(rotations)
    return replace(robot, parameters={name: replace(p, sigma=1.0) for name, p in robot.parameters.items()})
