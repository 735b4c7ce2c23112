# SPDX-License-Identifier: BSD-3-Clause
"""A guessed robot as the text of a robot file; everything that was guessed says so and why."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from jointscope.robots.units import joined, si_factor, si_unit
from jointscope.tools.init.estimates.drive_values import TYPED
from jointscope.tools.init.estimates.joint_signs import SignGuess
from jointscope.tools.init.estimates.target_places import GuessedTarget
from jointscope.tools.init.robot_guess import SUPPLY, RobotGuess
from jointscope.tools.init.streams.named_signal import Chosen
from jointscope.tools.init.streams.sensor_noise import NoiseGuess
from jointscope.tools.init.text.accelerometer_text import accelerometer_lines
from jointscope.tools.init.text.current_text import current_lines, current_parameters
from jointscope.tools.init.text.drive_text import effect_lines, parameter_lines
from jointscope.tools.init.text.gyro_text import gyro_lines
from jointscope.tools.init.text.held_text import held_lines
from jointscope.tools.init.text.robot_line import GUESS
from jointscope.tools.init.text.robot_line import as_list as _list
from jointscope.tools.init.text.robot_line import line as _line
from jointscope.tools.init.text.robot_line import number as _number
from jointscope.tools.init.text.robot_line import plain as _plain
from jointscope.tools.init.text.source_text import FINEST, sigma_line, source_lines
from jointscope.tools.init.text.target_text import target_lines, target_parameters

LOOSE = (0.35, 0.26)  # [rad/s/sqrt(s)] densities that a calibration begins with


def robot_text(guess: RobotGuess, urdf: str, targets: Sequence[GuessedTarget] = ()) -> str:
    """The robot file.

    Args:
        guess: what was found.
        urdf: how the file names the URDF.
        targets: what a tracker measures of it.
    """
    joints = guess.roles.joints
    free = guess.free_links
    lines = [
        f"# {guess.name}: written by `jointscope init` from {guess.urdf.name} and {guess.bag}.",
        f"# Lines marked {GUESS} were concluded from that recording; check them, then delete the mark.",
        "format: 1",
        f"name: {_plain(guess.name)}",
        f"urdf: {_plain(urdf)}",
        _line(f"gravity: {_list(guess.gravity)}", f"[m/s^2] in the base frame; {_gravity(guess)}", sure=False),
        _line(f"joints: {_list(joints)}", "joints of the URDF that move and are driven in the recording"),
        *(f"# {text}" for text in guess.following),
        *held_lines(guess.held),
        "",
        "model:",
        *_model(free, tuple(joint for joint in joints if joint not in guess.elastic)),
        "",
        *_constants(guess),
        *_command(guess),
        "",
        "sensors:",
        *_motor_encoder(guess),
        *_link_encoder(guess),
        *(_torque(guess) if free else current_lines(guess)),
        *(line for gyro in guess.gyros for line in gyro_lines(gyro, guess.encoder_signs)),
        *(line for gyro in guess.gyros if not free for line in accelerometer_lines(gyro, guess.gravity)),
        *(line for target in targets for line in target_lines(target)),
        *(f"  # not used: {text}" for text in guess.left_out),
        "",
        *effect_lines(guess),
        *parameter_lines(guess),
        *([] if free else current_parameters(guess)),
        *target_parameters(targets),
        *([] if free else _noise(len(joints))),
    ]
    return "\n".join(lines) + "\n"


def _gravity(guess: RobotGuess) -> str:
    return guess.gravity_reason or "z of the base points up"


def _model(free: bool, rigid_joints: tuple[str, ...]) -> list[str]:
    said = "`jointscope discover` finds which joints are elastic"
    rigid = [_line(f"rigid_joints: {_list(rigid_joints)}", said, indent=2)] if rigid_joints else []
    if free:
        return [_line("link_dynamics: free", "the URDF has no inertias", indent=2), *rigid]
    return [_line("integrator: simpson", "euler | midpoint | simpson", indent=2), "  coriolis: true", *rigid]


def _constants(guess: RobotGuess) -> list[str]:
    if guess.command_unit[0] != "duty":
        return []
    text = f"motor.supply_voltage: {SUPPLY}"
    return ["constants:", _line(text, "[V] not in the recording; see the data sheet", sure=False, indent=2), ""]


def _names(chosen: Chosen, joints: tuple[str, ...], indent: int) -> list[str]:
    if not chosen.names or chosen.names == joints:
        return []
    if not chosen.signal.names:
        text = f"places in {chosen.signal.topic}, counted from 0, in the order of `joints`"
    elif chosen.by_order:
        text = f"in {chosen.signal.topic}, nothing in common with the URDF: taken in its order, which may be wrong"
    elif chosen.by_ending:
        text = f"in {chosen.signal.topic}, in the order of `joints`; matched by their endings"
    else:
        text = f"in {chosen.signal.topic}, in the order of `joints`"
    return [_line(f"names: {_list(chosen.names)}", text, False, indent)]


def _signs(signs: Iterable[float], reason: str, indent: int) -> list[str]:
    values = [float(sign) for sign in signs]
    return [_line(f"scale: {_list(values)}", reason, False, indent)] if min(values) < 0 else []


def _scale(scales: Sequence[float], reason: str) -> list[str]:
    """Factors on the positions of joints that count backwards or before a gear."""
    values = [float(f"{scale:.6g}") for scale in scales]
    return [] if all(value == 1.0 for value in values) else [_line(f"scale: {_list(values)}", reason, False, 4)]


def _wraps(chosen: Chosen) -> list[str]:
    if not chosen.wraps:
        return []
    return [_line(f"wraps: {chosen.wraps:.9g}", "jumps by that much from one sample to the next", False, 4)]


def _stamps(chosen: Chosen, guess: RobotGuess) -> list[str]:
    """Whose stamps the samples have, where the messages are one for one with those of the gyroscopes."""
    gyros = [gyro for gyro in guess.gyros if gyro.name in guess.stamped_by]
    if not gyros or any(len(gyro.signal.as_sent.times) != len(chosen.signal.as_sent.times) for gyro in gyros):
        return []
    reason = "positions are smoother at the stamps of these gyroscopes than at those of their messages"
    return [_line(f"stamped_by: {_list(guess.stamped_by)}", reason, False, 4)]


def _turned_joints(found: SignGuess) -> str:
    others = " or ".join(_list(signs) for signs in found.others)
    if found.by_torques:
        also = f"; with {others} as well" if others else ""
        return f"only so do the masses of the URDF explain the commands{also}: its axis points the other way"
    return f"so do the gyroscopes agree; as well with {others}" if others else "only so do the gyroscopes agree"


def _command(guess: RobotGuess) -> list[str]:
    command, joints = guess.roles.command, guess.roles.joints
    unit, why = guess.command_unit
    signs = [drive.sign for drive in guess.drives]
    lines = [
        _line("command:", command.reason, command.sure),
        *source_lines(command.signal, unit, 2)[:3],
        _line(f"unit: {unit}", f"{why}; duty | V | A | N m", sure=why == TYPED, indent=2),
        *([_line("confirmed: true", "you named the unit", True, 2)] if why == TYPED else []),
        *_names(command, joints, 2),
        *_signs(signs, "moves against its command", 2),
        *_measured(guess),
    ]
    weak = [joint for joint, drive in zip(joints, guess.drives, strict=True) if drive.confidence < 10.0]
    if weak:
        lines.append(f"  # {GUESS}: the sign of {', '.join(weak)} cannot be seen in this recording; taken as positive")
    return lines


def _measured(guess: RobotGuess) -> list[str]:
    """Whether the drive signal is held, where its place, or the motion against its place, makes that a question."""
    beside = guess.roles.command.signal.topic == guess.roles.motor_encoder.signal.topic
    if not beside and guess.held_command:
        return []
    if guess.held_command:
        return [_line("held: true", "the motion says so, although it stands beside the positions", False, 2)]
    where = "measured beside the positions" if beside else "the motion says that it was measured"
    return [_line("held: false", f"{where}; true: a command that acts until the next one", False, 2)]


def _sigmas(noises: tuple[NoiseGuess, ...], units: tuple[str, ...]) -> str:
    """The line with the noise of encoders, a list where they measure in different units."""
    if len(set(units)) == len(set(noises)) == 1:
        return sigma_line(noises[0], units[0])
    sigmas = [si_factor(unit) * (n.sigma or 1e-4) for n, unit in zip(noises, units, strict=True)]
    values = [_number(max(sigma, FINEST)) for sigma in sigmas]
    reasons = "; ".join(dict.fromkeys(n.reason for n in noises))
    return _line(f"sigma: [{', '.join(values)}]", f"[{joined([si_unit(u) for u in units])}] {reasons}", False, 4)


def _motor_encoder(guess: RobotGuess) -> list[str]:
    signs, noise = _turned_joints(guess.encoder_signs), guess.encoder_noise
    zero = "counts from where the motor stood when it was switched on"
    lines = [_line("zero: unknown", zero, False, 4)] if guess.free_links else []
    if any(guess.motor_zero):
        values = [float(f"{value:.6g}") for value in guess.motor_zero]
        lines = [_line(f"zero: {_list(values)}", "differs by that from the encoder on the link all the time", False, 4)]
    return _encoder("motor_encoder", guess.roles.motor_encoder, guess, signs, noise, lines)


def _link_encoder(guess: RobotGuess) -> list[str]:
    chosen, noise = guess.roles.link_encoder, guess.link_noise
    if chosen is None or noise is None:
        return []
    return _encoder("link_encoder", chosen, guess, "as the motor encoder", noise, [])


def _encoder(
    kind: str, chosen: Chosen, guess: RobotGuess, signs: str, noise: tuple[NoiseGuess, ...], zero: list[str]
) -> list[str]:
    units = guess.position_units.units
    unit = units[0] if len(set(units)) == 1 else _list(units)
    source = source_lines(chosen.signal, unit)
    scales = np.array(guess.encoder_signs.signs) * np.array(guess.position_units.scales or 1.0)
    if guess.position_units.scales:
        signs = f"{guess.position_units.reason}; {signs}" if min(scales) < 0 else guess.position_units.reason
    elif guess.position_units.reason:
        source[-1] = _line(f"unit: {unit}", guess.position_units.reason, False, 4)
    return [
        f"  {kind}:",
        _line(f"kind: {kind}", chosen.reason, chosen.sure, 4),
        *source,
        *_names(chosen, guess.roles.joints, 4),
        *_wraps(chosen),
        *_stamps(chosen, guess),
        *_scale(scales.tolist(), signs),
        *zero,
        _sigmas(noise, units),
    ]


def _torque(guess: RobotGuess) -> list[str]:
    chosen = guess.roles.joint_torque
    if chosen is None or guess.torque_noise is None:
        return []
    return [
        "  joint_torque:",
        _line("kind: joint_torque", chosen.reason, chosen.sure, 4),
        *source_lines(chosen.signal, "N m"),
        *_names(chosen, guess.roles.joints, 4),
        *_stamps(chosen, guess),
        sigma_line(guess.torque_noise, "N m"),
    ]


def _noise(n: int) -> list[str]:
    link, motor = LOOSE
    return [
        "",
        "noise:",
        _line(
            "estimate: true",
            "random torques, as densities of the velocities [rad/s/sqrt(s), of slides m/s/sqrt(s)]",
            indent=2,
        ),
        f"  link_velocity: {_list([link] * n)}",
        f"  motor_velocity: {_list([motor] * n)}",
    ]
