# SPDX-License-Identifier: BSD-3-Clause
"""Whether masses of the URDF and torques of the commands can both be right: a fit does not show a common factor.

With all masses times a factor, every constant, inertia and friction comes out times the same factor, and the residuals
are as small as before. Two things tell: bodies that are denser than steel, and commands in N m of which one makes more
or less than one. Constants of currents are looked at by torque_constants.py. One link that weighs something else, as
with a load that the URDF lacks, leaves a little in the residuals, and `graphs/scoring/wrong_masses.py` reads it.
"""

from __future__ import annotations

import numpy as np

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.rests.rests_beside_motion import seen_rests
from jointscope.graphs.scoring.regression.wrong_links import WrongLink
from jointscope.graphs.starts.drive_regression import Value
from jointscope.robots.bodies.possible_masses import impossible_masses
from jointscope.robots.model.command_words import edited_argument, init_command, robot_argument
from jointscope.tools.presentation.numbers import significant
from jointscope.tools.verdicts.given_recordings import given

CONSTANT = "torque_constant"
MASSES = (0.05, 0.25)  # share by which one N m of the command may be off: fine up to the first, bad beyond the second
SURER = 2.0  # times as small is the logarithm of the p-value of an effect that is said in place of a mass
SURE = 3.5  # [sigma]
ALIKE = 0.1  # share by which constants of drives may differ that are one number, in spite of wrong moments
STRONGEST = 500.0  # [N m/A] behind the largest gears of industrial robots


def plausible_torques(result: CalibrationResult) -> tuple[str, str]:
    """A level of `judgement.LEVELS` and a sentence."""
    robot = result.robot
    if robot.free_links:
        return "info", "Without masses there is nothing to compare torques with."
    constants = [p for p in result.parameters if p.name in {f"{joint}.{CONSTANT}" for joint in robot.joints}]
    heavy = impossible_masses(robot.tree.model)
    if heavy is not None:
        grams = f"; in grams they would be 1000 times too large{_by_thousand(constants)}"
        return "bad", (
            f"link {heavy.link} of {robot.tree.urdf.name} has {significant(heavy.mass)} kg, and what moves weighs at "
            f"least {heavy.density:,.0f} kg/m3 (steel 7,900): its masses cannot be right{grams}. Correct <mass> and "
            f"<inertia> there, then {_again(result)}."
        )
    strong = max(constants, key=lambda p: p.value, default=None)
    if strong is not None and strong.value > STRONGEST and strong.unit == "N m/A":
        return "bad", (
            f"{strong.name} is {significant(strong.value)} N m/A, more than any drive makes: masses of "
            f"{robot.tree.urdf.name} in grams, or commands in another unit? Correct it, then {_again(result)}."
        )
    if (link := result.asked.link) is not None:
        return "bad", _wrong_link(result, link)
    return _torques(result) or _load(result, constants) or _scale(result, constants) or ("good", _nothing(constants))


def _nothing(constants: list[ParameterEstimate]) -> str:
    text = "Nothing speaks against the masses of the URDF"
    return f"{text}, to which all values here are in proportion." if constants else f"{text}."


def _scale(result: CalibrationResult, constants: list[ParameterEstimate]) -> tuple[str, str] | None:
    """Masses of links that are calibrated beside torque constants: what is left of the URDF sets the scale of both."""
    masses = [here.label for here in result.robot.effects if here.effect.id == "link_mass"]
    if not masses or not constants or _known_loads(result):
        return None
    return "bad", (
        f"{', '.join(masses)} and the torque constants are told by the same weights: a load at another place than the "
        f"link's makes all of them wrong by one factor. Give the constants of the drives, `fixed: true` beside each "
        f"{CONSTANT} in {result.start.path.name}, then calibrate again; or correct the masses of "
        f"{result.robot.tree.urdf.name}."
    )


def _known_loads(result: CalibrationResult) -> bool:
    """Whether rests beside the motion carried loads that are known: these set the scale of drives and links."""
    seen = seen_rests(result)
    return seen is not None and any(bool(np.any(problem.rests.forces)) for problem in seen.problems)


def _wrong_link(result: CalibrationResult, link: WrongLink) -> str:
    """A link that weighs something else by regression: by how much, what that changes, and what to do."""
    robot, urdf = result.robot, result.robot.tree.urdf.name
    body = robot.tree.model.inertias[robot.tree.model.getJointId(link.joint)].mass
    if link.turn:
        return _other_zero(result, link)
    alike = f" (or one that {' or '.join(link.alike)} moves, which looks alike here)" if link.alike else ""
    by = f"{link.mass:+.3g} ± {significant(link.sigma, 1)} kg"
    which = f"the link that {link.joint} moves{alike}"
    if not link.moments:
        old, new = significant(body), significant(body + link.mass)
        what = f"{which} weighs {new} kg, not the {old} kg of {urdf} ({by}, {100.0 * link.share:+.2g} %)"
    else:
        load = f"carries a load that {urdf} lacks" if link.mass > 0.0 else f"is not that of {urdf}"
        what = f"{which} {load}: {by}, and the centre of mass elsewhere by {_place(link, body + link.mass)}"
    drives = ". Drives that make more or less torque than they are asked for would look alike" if link.drives else ""
    found = result.found
    moved = {n: f for n, f in link.with_it.items() if n in found}
    worst = max(moved, key=lambda name: abs(moved[name] - 1.0), default="")
    then = f"; with it {worst} would be {100.0 * (moved[worst] - 1.0):+.2g} %" if worst else ""
    output = edited_argument(result.start, "link_mass")
    return (
        f"By regression of all joints {what}: {_seen(link)}{then}{drives}. Correct the "
        f"URDF, then {_again(result)}; or let it be found: `jointscope add {robot_argument(result.start)} "
        f"link_mass@{link.joint} -o {output}`, then calibrate again."
    )


def _other_zero(result: CalibrationResult, link: WrongLink) -> str:
    """What a joint moves seems to be turned about its axis: the zero of its encoder, most likely."""
    joint, output = link.joint, edited_argument(result.start, "encoder_offset")
    turned = f"in the URDF all behind {joint} is turned about its axis"
    also = "".join(f", and that of {other} {significant(angle, 2)} rad" for other, angle in link.beside)
    others = [f"that of {other}" for other in link.alike]
    others += ["the base is not level: gravity_direction@robot"] * link.tilted
    return (
        f"By regression of all joints the encoder of {joint} reads {significant(link.turn, 2)} ± "
        f"{significant(link.sigma, 1)} rad{also} too much for the URDF (or {' or '.join([*others, turned])}, which "
        f"looks the same): {_seen(link)}. Add {'them' if also else 'it'}: `jointscope add "
        f"{robot_argument(result.start)} {link.label} -o {output}`, then calibrate again; or correct the URDF, then "
        f"{_again(result)}."
    )


def _seen(link: WrongLink) -> str:
    """Where it shows, and how large it is there."""
    return (
        f"that is the shape of {100.0 * link.explained:.0f} % of what is missing at {link.seen_at}, "
        f"{significant(100.0 * link.size, 2)} % of its drive's torque"
    )


def _place(link: WrongLink, mass: float) -> str:
    """Where first moments move the centre of mass."""
    return (
        "("
        + ", ".join(f"{1e3 * moment / max(mass, 1e-9):.0f}" for moment in link.moments)
        + f") mm in the frame of {link.joint}"
    )


def _load(result: CalibrationResult, constants: list[ParameterEstimate]) -> tuple[str, str] | None:
    """One link that weighs something else: what that would change is wrong by as much."""
    # to one linear step these look like masses
    named = result.asked.causes or result.asked.gains or given(result)
    effects = [effect for effect in result.lacking if effect.moved(result.found)]
    for mass in () if named else result.masses:
        shares = mass.moved(result.found)
        if not shares or any(effect.p_value <= mass.p_value**SURER for effect in effects):
            continue  # a spring that hardens weighs something, too, in a model that lacks it
        if abs(mass.mass) < SURE * mass.sigma:
            return "bad", _another_place(result, mass.joint)
        worst = max(shares, key=lambda name: abs(shares[name]))
        torques = mass.mass < 0.0 and constants and max(p.value for p in constants) < 1.0
        other = f" Or its commands are torques, and it carries more: {_again(result, 'Nm')}." if torques else ""
        return "bad", (
            f"The recording asks for another mass behind {mass.joint}, by {mass.mass:+.2g} ± "
            f"{significant(mass.sigma, 1)} kg if all of it were in the link there: a load that "
            f"{result.robot.tree.urdf.name} lacks, or another robot? With it {worst} would be "
            f"{100.0 * shares[worst]:+.0f} %. Add the load to the URDF as a link, with its mass and place, then "
            f"{_again(result)}.{other}"
        )
    return None


def _another_place(result: CalibrationResult, joint: str) -> str:
    """First moments that are wrong where the mass may be right: weight in another direction does the same."""
    file, output = robot_argument(result.start), edited_argument(result.start, "gravity_direction")
    return (
        f"The recording asks for weight at another place behind {joint}, as a load would that "
        f"{result.robot.tree.urdf.name} lacks, or a base that is not level. If that may be: `jointscope add {file} "
        f"gravity_direction@robot -o {output}`, then calibrate again; otherwise correct the "
        "masses and their places in the URDF."
    )


def _torques(result: CalibrationResult) -> tuple[str, str] | None:
    """Commands in N m: by regression one of them makes one, or masses and torques do not go together."""
    robot = result.robot
    if robot.command.unit != "N m" or result.asked.gains or given(result):
        return None
    found = {joint: result.regressed.get(f"{joint}.{CONSTANT}") for joint in robot.joints}
    off = {j: v for j, v in found.items() if v is not None and abs(v.value - 1.0) > max(MASSES[0], SURE * v.sigma)}
    if not off:
        return None
    worst = max(off, key=lambda joint: _factor(off[joint]))
    known = [v.value for v in found.values() if v is not None]
    alike = _one_factor(known) if len(off) == len(known) else ""  # of one that is off the others say nothing
    far = all(_factor(value) > 1.0 + MASSES[1] for value in off.values())
    unit = f" Only if the command is no torque: {_again(result, 'A')}." if far else ""
    text = (
        f"The command is in N m, but with the masses of {robot.tree.urdf.name} one moves as "
        f"{', '.join(f'{significant(v.value)} ({j})' for j, v in off.items())} N m would: masses or torques are wrong "
        f"by that factor{alike}. Does it carry a load that the URDF lacks, or is it another robot's? Correct "
        f"the masses, then {_again(result)}.{unit}"
    )
    return ("bad" if _factor(off[worst]) > 1.0 + MASSES[1] else "warn"), text


def _factor(value: Value) -> float:
    return float("inf") if value.value <= 0.0 else max(value.value, 1.0 / value.value)


def _by_thousand(constants: list[ParameterEstimate]) -> str:
    """What the constants would be with masses a thousand times smaller."""
    if not constants:
        return ""
    listed = ", ".join(f"{significant(p.value / 1000.0)}" for p in constants)
    return f", and constants {listed} instead of {', '.join(significant(p.value) for p in constants)}"


def _one_factor(values: list[float]) -> str:
    middle = float(np.median(values))
    alike = len(values) > 1 and bool(np.all(np.abs(np.array(values) - middle) <= ALIKE * abs(middle)))
    return f"; alike at all joints, so masses times {significant(1.0 / middle)} would fit" if alike and middle else ""


def _again(result: CalibrationResult, unit: str = "") -> str:
    """The command that begins anew."""
    bag = result.bags[0].recording.path if result.bags else "BAG"
    return f"`{init_command(result.start, bag, 'anew', unit=unit)}`"
