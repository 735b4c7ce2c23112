# SPDX-License-Identifier: BSD-3-Clause
"""Lines of a robot file about measured currents."""

from __future__ import annotations

from jointscope.robots.units import of_slide
from jointscope.tools.init.estimates.measured_currents import GuessedCurrents
from jointscope.tools.init.robot_guess import RobotGuess
from jointscope.tools.init.text.drive_text import LOST_SPREAD, SPREAD
from jointscope.tools.init.text.robot_line import GUESS, as_list, line, number
from jointscope.tools.init.text.source_text import source_lines

NAME = "motor_current"
OFFSETS = 5.0  # times an offset, or the noise, that its prior is wide
SMALLEST = 1e-6  # [A] sigma below which nothing was to be seen


def current_lines(guess: RobotGuess) -> list[str]:
    """The sensor; empty where none was found."""
    found = guess.currents
    if found is None:
        return []
    said = f"efforts that the motors report; commands and speeds leave {100.0 * found.share:.2g} % of them at most"
    source = source_lines(found.chosen.signal, "A")
    source[-1] = line("unit: A", "nothing in the recording says so; see the driver", False, 4)
    names = [f"    names: {as_list(found.chosen.names)}"] if found.chosen.names != guess.roles.joints else []
    turned = "against the commands"
    signs = [line(f"scale: {as_list(found.signs)}", turned, False, 4)] if min(found.signs) < 0.0 else []
    sigmas = ", ".join(number(max(noise.sigma, SMALLEST)) for noise in found.noise)
    reasons = "; ".join(dict.fromkeys(noise.reason for noise in found.noise))
    return [
        f"  {NAME}:",
        line(f"kind: {NAME}", said, False, 4),
        *source,
        *(names if found.chosen.names else []),
        *signs,
        line(f"sigma: [{sigmas}]", f"[A] {reasons}", False, 4),
    ]


def current_parameters(guess: RobotGuess) -> list[str]:
    """Torque of one ampere at each joint, from the drive's gain, and the back-EMF; nobody knows the supply yet."""
    return [] if guess.currents is None else _constants(guess, guess.currents)


def _constants(guess: RobotGuess, found: GuessedCurrents) -> list[str]:
    lines, parts = [], zip(found.per_ampere, found.back_emf, found.offset, found.noise, found.lost, strict=True)
    for joint, (value, back_emf, offset, noise, lost) in zip(guess.roles.joints, parts, strict=True):
        unit, of_speed = (of_slide(u) if joint in guess.slides else u for u in ("N m/A", "A s/rad"))
        spread = number((LOST_SPREAD if lost else SPREAD) * value)
        text = f"{NAME}.torque_per_ampere_{joint}: {{value: {number(value, 5)}, unit: {unit}, prior_sigma: {spread}}}"
        why = f"{GUESS}: ratios only; the data sheet knows it: gear ratio times k_t"
        lines.append(line(text, why, indent=2) if lost else f"  {text}")
        spread = number(SPREAD * back_emf)
        text = f"{NAME}.back_emf_{joint}: {{value: {number(back_emf, 5)}, unit: {of_speed}, prior_sigma: {spread}}}"
        lines.append(line(text, "k_pwm where volts are volts: without this line it is held to that", indent=2))
        spread = number(max(OFFSETS * abs(offset), OFFSETS * noise.sigma, SMALLEST))
        value_of = f"{{value: {number(offset, 5)}, unit: A, positive: false, prior: 0.0, prior_sigma: {spread}}}"
        lines.append(f"  {NAME}.offset_{joint}: {value_of}")
    return lines
