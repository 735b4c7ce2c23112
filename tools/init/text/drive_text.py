# SPDX-License-Identifier: BSD-3-Clause
"""Effects and parameters of a guessed robot: start values of the drives with what the regression says about each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointscope.graphs.starts.command_limits import CommandLimit
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.model.robot import SHARPNESS
from jointscope.robots.units import of_slide, si_unit
from jointscope.tools.init.estimates.drive_values import EXPLAINED, DriveValues
from jointscope.tools.init.robot_guess import SUPPLY, RobotGuess
from jointscope.tools.init.text.robot_line import GUESS, as_list, line, number, plain

RESONANCE, DAMPING_RATIO = 5.0, 0.1  # [Hz], [1] of a link on its spring, where a gyroscope will tell
VISCOUS_EFFECT = ("N m", "A")  # units of commands whose viscous friction is an effect
DELAY_EFFECT = "command_delay@robot"
LIMIT_EFFECT = "command_limit"
DELAY_PRIOR = 0.01  # [s] filters of currents and cycles of buses take milliseconds
SURE = 5.0  # [sigma] below zero from which a value is no uncertain one
ZERO_BY_DEFAULT = ("motor_viscous.coefficient",)  # its prior is about none
SPREAD, LOST_SPREAD = 2.0, 5.0  # [value] priors of logarithms: a factor 7, or 150, either way
NO_PULL = 10.0  # times wider, about zero


@dataclass(frozen=True)
class _Row:
    """One parameter of a joint: name, value, unit at a joint that turns, comment, and whether nothing tells it."""

    name: str
    value: float
    unit: str
    comment: str
    lost: bool


def effect_lines(guess: RobotGuess) -> list[str]:
    """Viscous friction of drives whose command is a torque or a current; that of a voltage is in the back-EMF.

    A drive signal that was measured was so some time before or after the positions in its message.
    """
    if guess.free_links:
        return []
    viscous = guess.command_unit[0] in VISCOUS_EFFECT
    labels = [f"motor_viscous@{joint}" for joint in guess.roles.joints] if viscous else []
    reasons = ["friction that grows with speed, as drives with gears have it"] if viscous else []
    for joint, drive in limited_drives(guess):
        labels.append(f"{LIMIT_EFFECT}@{joint}")
        reasons.append(limit_text(guess, joint, drive))
    if is_measured(guess):
        labels.append(DELAY_EFFECT)
        reasons.append("time between the measured drive signal and the positions in its message")
    return [line(f"effects: {as_list(labels)}", "; ".join(reasons), False), ""] if labels else []


def limited_drives(guess: RobotGuess) -> list[tuple[str, CommandLimit]]:
    """Joints whose drive gives no more than a limit."""
    drives = zip(guess.roles.joints, guess.drives, strict=True)
    return [(joint, drive.limit) for joint, drive in drives if drive.limit is not None]


def limit_text(guess: RobotGuess, joint: str, limit: CommandLimit) -> str:
    """A sentence about such a drive, without commas that end it."""
    unit = _limit_unit(guess, joint)
    size = f"{limit.level:.4g}" + f" {unit}" * (unit != "1")
    return f"{joint} gives no more than {size} ({100.0 * limit.share:.2g} % of its commands are beyond)"


def _limit_unit(guess: RobotGuess, joint: str) -> str:
    unit = si_unit(guess.command_unit[0])
    return of_slide(unit) if joint in guess.slides else unit


def _limit_lines(guess: RobotGuess, joint: str, limit: CommandLimit | None) -> list[str]:
    """The level beyond which a drive gives no more, and that it then gives nothing more."""
    if limit is None:
        return []
    name, level = f"  {joint}.{LIMIT_EFFECT}", number(limit.level, 5)
    spread = number(SPREAD * limit.level)
    return [
        f"{name}.lost: {{value: 1.0, unit: '1', fixed: true}}",
        f"{name}.limit: {{value: {level}, unit: {plain(_limit_unit(guess, joint))}, prior_sigma: {spread}}}",
    ]


def is_measured(guess: RobotGuess) -> bool:
    """Whether the drive signal was measured, and so belongs to an instant that its stamp may miss."""
    return not guess.held_command


def parameter_lines(guess: RobotGuess) -> list[str]:
    """The section of the parameters."""
    if guess.free_links:
        return ["parameters: {}"]
    lines = [line("parameters:", "start values by regression; a calibration finds them", False), *_unexplained(guess)]
    for joint, drive in zip(guess.roles.joints, guess.drives, strict=True):
        for row in (
            *_drive_rows(guess.command_unit[0], drive),
            *_spring_rows(drive if joint in guess.elastic else None),
        ):
            unit = of_slide(row.unit) if joint in guess.slides else row.unit
            spread = number((LOST_SPREAD if row.lost else SPREAD) * row.value)
            prior = f"prior_sigma: {spread}"
            if row.name in ZERO_BY_DEFAULT:
                spread = number(max(SPREAD * NO_PULL * row.value, 1.0))
                prior = f"prior: 0.0, prior_sigma: {spread}, positive: false, 'null': 0.0"
            text = f"{joint}.{row.name}: {{value: {number(row.value, 5)}, unit: {unit}, {prior}}}"
            lines.append(line(text, row.comment, indent=2) if row.comment else f"  {text}")
        lines += _limit_lines(guess, joint, drive.limit)
    return [*lines, *_delay_lines(guess)]


def _delay_lines(guess: RobotGuess) -> list[str]:
    """How much later than measured a drive signal acts; below zero where it was filtered or sent late."""
    if not is_measured(guess):
        return []
    prior = f"prior: 0.0, prior_sigma: {DELAY_PRIOR}, positive: false, 'null': 0.0"
    return [f"  robot.command_delay.delay: {{value: 0.0, unit: s, {prior}}}"]


def _unexplained(guess: RobotGuess) -> list[str]:
    """Joints whose torque the regression does not explain."""
    poor = [
        f"{100.0 * max(drive.explained, 0.0):.3g} % of that of {joint}"
        for joint, drive in zip(guess.roles.joints, guess.drives, strict=True)
        if drive.explained < EXPLAINED
    ]
    if not poor:
        return []
    why = "a spring, wrong masses, gravity, names or units"
    return [f"  # {GUESS}: the regression explains only {', '.join(poor)}: {why} may be the reason"]


def _drive_rows(unit: str, drive: DriveValues) -> list[_Row]:
    """Parameters of a drive; the gain of a duty cycle is per volt."""
    volts = SUPPLY if unit == "duty" else 1.0
    rows = [_row("coulomb_torque", "N m", drive, "dry"), _row("inertia", "kg m2", drive, "inertia")]
    if drive.sharpness is not None:
        rows.append(_Row(SHARPNESS, drive.sharpness, "s/rad", "k in tanh(k v) of dry friction", False))
    if unit == "A":
        rows.append(_row("torque_constant", "N m/A", drive, "gain"))
    if unit in VISCOUS_EFFECT:
        return [*rows, _row("motor_viscous.coefficient", "N m s/rad", drive, "viscous")]
    return [*rows, _row("k_pwm", "N m/V", drive, "gain", volts), _row("k_mi", "N m s/rad", drive, "viscous")]


def _row(name: str, unit: str, drive: DriveValues, law: str, per: float = 1.0) -> _Row:
    value, found = drive.start[law] / per, drive.found.get(law)
    if drive.is_lost(law):
        return _Row(name, value, unit, f"{GUESS}: {_why_lost(drive, found)}", True)
    assert found is not None
    return _Row(name, value, unit, f"+- {found.sigma / per:.1g}", False)


def _why_lost(drive: DriveValues, found: Value | None) -> str:
    if drive.unknown_scale:
        return "the recording gives ratios of drive values only; hold one that you know with `fixed: true`"
    if found is None:
        return "the recording is too short, or moves too little, to tell"
    says = f"the regression says {found.value:.2g} +- {found.sigma:.1g}"
    if found.value < -SURE * found.sigma:
        return f"{says}, below zero, which cannot be: masses, units or names are wrong, or a spring gives way"
    return f"lost in its uncertainty: {says}"


def _spring_rows(drive: DriveValues | None) -> list[_Row]:
    """A spring as both encoders show it, or at a plain frequency, where a gyroscope will tell the right one."""
    if drive is None:
        return []
    omega = 2.0 * np.pi * RESONANCE
    stiffness, said = drive.link * omega**2, ""
    if drive.spring is not None:
        stiffness, said = drive.spring.stiffness, "torque of the links over the difference of both encoders"
    damping = 2.0 * DAMPING_RATIO * np.sqrt(drive.link * stiffness)
    if drive.spring is not None and drive.spring.damping > 0.0:
        damping = drive.spring.damping
    return [_Row("stiffness", stiffness, "N m/rad", said, False), _Row("damping", damping, "N m s/rad", "", False)]
