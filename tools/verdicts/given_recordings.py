# SPDX-License-Identifier: BSD-3-Clause
"""What recordings show that the model cannot be: saturated drives, two loads, odd trackers, too few samples."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.calibration.findings import CHI2_HIGH
from jointscope.graphs.scoring.regression.changed_load import ChangedLoad
from jointscope.robots.model.command_words import edited_argument, robot_argument
from jointscope.tools.presentation.left_out import recording_arguments
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.half_a_sample import fitted_half_sample

MOST_READINGS = 4
RARE = 0.05  # [s] between samples: a drive's controller is ten times as fast, and what it did between them is not known


def given(result: CalibrationResult) -> list[tuple[str, str]]:
    """Names of checks that fail, with a sentence each; what they say comes before all that steps with effects say."""
    found = []
    if result.exchanged:
        found.append(("Each joint with its own commands and positions", _sentence(result.exchanged)))
    if misdescribed := result.misdescribed or fitted_half_sample(result):
        found.append(("Transmission and drive signal as the robot file says", _sentence(misdescribed.rstrip("."))))
    if result.saturated:
        found.append(("Drives that give what is commanded", result.saturated))
    if odd := odd_trackers(result):
        found.append(("Trackers that stand still and stamp as encoders do", odd))
    if (changed := result.asked.changed) is not None:
        name, sentence = ("Nothing pushes", _push) if changed.push else ("One load throughout", _two_loads)
        found.append((name, sentence(changed, result)))
    if result.torque_readings:
        sensors = "Measured currents" if all(one.unit == "A" for one in result.torque_readings) else "Torque sensors"
        found.append((f"{sensors} as the robot file has them", _readings(result)))
    if rare := rare_samples(result):
        found.append(("Samples often enough", rare))
    return found


def odd_trackers(result: CalibrationResult) -> str:
    """Sentences on trackers that seem to be late or to have moved, and that the calibrated model does not explain."""
    off = {channel.rsplit(".", 1)[0] for channel, fit in result.channels.items() if fit.chi2 > CHI2_HIGH}
    return " ".join(f"{text}." for name, text in result.odd_trackers.items() if name in off)


def _readings(result: CalibrationResult) -> str:
    """A sentence on scales and offsets of sensors that the robot file lacks, with the lines to add."""
    told = result.torque_readings[:MOST_READINGS]
    units = ["" if one.unit == "1" else f" {one.unit}" for one in told]
    listed = ", ".join(
        f"{one.parameter} {significant(one.value)} ± {significant(one.sigma, 1)}{unit}"
        for one, unit in zip(told, units, strict=True)
    )
    more = len(result.torque_readings) - len(told)
    lines = " ".join(
        f"`{one.parameter}: {{value: {1.0 if one.unit == '1' else 0.0}, unit: {_unit(one.unit)}, "
        f"positive: {'true' if one.unit == '1' else 'false'}, "
        f"prior_sigma: {0.1 if one.unit == '1' else significant(3.0 * max(abs(one.value), 1.0), 1)}}}`"
        for one in told
    )
    return (
        f"The recording asks for {listed}{f' and {more} more' if more else ''}, by one linear step, and "
        f"{result.start.path.name} has no free parameter for them: springs and friction bend to such readings. Add "
        f"under parameters: {lines}; then calibrate again."
    )


def _unit(unit: str) -> str:
    return f"'{unit}'" if unit == "1" else unit


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def rare_samples(result: CalibrationResult) -> str:
    """A sentence where samples are rare and the model seems to be wrong: commands between them look like masses."""
    periods = [float(np.median(np.diff(bag.recording.command.times))) for bag in result.bags if bag.recording.streams]
    period = max(periods, default=0.0)
    asked = any(mass.moved(result.found) for mass in result.masses) or any(
        e.moved(result.found) for e in result.lacking
    )
    if period < RARE or not asked:
        return ""
    return (
        f"There are {significant(1.0 / period, 2)} samples a second, and the equations do not hold with them: where a "
        "drive gets more commands than are recorded, what it did between two samples looks like wrong masses and "
        "inertias. Record every command and position, 100 a second or more; only if each command did act until the "
        "next one, it is the model that is wrong: "
        f"`jointscope diagnose {robot_argument(result.start)} {_bags(result)}`."
    )


def _two_loads(changed: ChangedLoad, result: CalibrationResult) -> str:
    """A sentence with the commands for the stretch with another load and for the rest."""
    rest, stretch = ((changed.start, changed.stop),), ((0.0, changed.start), (changed.stop, changed.end))
    names = ("before", "after") if changed.stop >= changed.end else ("without", "with")
    one, other = _leaving(changed, result, names[0], rest), _leaving(changed, result, names[1], stretch)
    return (
        f"{_when(changed)} the arm carries something else than in the rest, as if a payload were taken up or set down, "
        f"or a force acted from outside: at {changed.joint} {significant(100.0 * changed.size, 2)} % of the drive's "
        f"torque. Calibrate the part alone whose load {result.robot.tree.urdf.name} has, the rest with {one}, or that "
        f"stretch with {other}."
    )


def _push(changed: ChangedLoad, result: CalibrationResult) -> str:
    """A sentence with the command for the rest of the recording."""
    unit = result.robot.unit_at(changed.joint, "N m")
    command = _leaving(changed, result, "without", ((changed.start, changed.stop),))
    return (
        f"{_when(changed)} something pushes on the arm from outside, or pulls, as a hand, a cable or a wall does: at "
        f"{changed.joint} with {significant(changed.push, 2)} {unit} that stay while it moves, "
        f"{significant(100.0 * changed.size, 2)} % of the drive's torque. Leave that stretch out: {command}."
    )


def _when(changed: ChangedLoad) -> str:
    until = "on" if changed.stop >= changed.end else f"to {changed.stop:.2f} s"
    return f"From {changed.start:.2f} s {until} in {changed.path}"


def _leaving(
    changed: ChangedLoad, result: CalibrationResult, name: str, stretches: Sequence[tuple[float, float]]
) -> str:
    """The command that calibrates without some stretches."""
    begin = f"jointscope calibrate {robot_argument(result.start)} {_bags(result)} -o"
    out = [shlex.quote(f"{changed.path}:{t0:.2f}:{t1:.2f}") for t0, t1 in stretches if t1 > t0]
    return f"`{' '.join([begin, edited_argument(result.start, name), *(f'--leave-out {one}' for one in out)])}`"


def _bags(result: CalibrationResult) -> str:
    return recording_arguments([bag.recording for bag in result.bags])
