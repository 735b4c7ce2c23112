# SPDX-License-Identifier: BSD-3-Clause
"""The unit of a drive by consistency: with masses from the URDF, only torques in N m move the joints as they should.

The regression tells how many N m one unit of the command is. About one on all joints says N m; masses in URDFs are off
by 10 to 20 %. So does one within 3 % where half of the joints are about one: a torque constant would hit it by chance
on one joint of fifty, and the other joints have something that the URDF lacks. Anything else is a current, or a duty
cycle if it never exceeds one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointscope.graphs.starts.drive_regression import Value
from jointscope.graphs.starts.second_opinion import TOLD

LARGEST_DUTY = 1.0 + 1e-6
LARGEST_VOLTS = 60.0
MASSES = 0.25  # relative; how far the masses of a URDF may be off
ONE_DRIVE = 0.1  # relative; a single duty cycle may give about 1 N m by chance
SURE = 3.5  # [sigma]
ALIKE = 0.03  # relative
LOADED = 0.3  # N m per N m: no arm carries more than twice what it weighs


def drive_unit(
    joints: Sequence[str],
    gains: Sequence[Value | None],
    largest: float,
    heavy: Sequence[str] = (),
    *,
    massless: bool = False,
) -> tuple[str, str]:
    """Unit of the drives and why.

    Args:
        joints: their names.
        gains: torque per unit of the command of each [N m]; None where the recording cannot tell.
        largest: largest absolute command.
        heavy: joints that commands in N m could not move as they moved.
        massless: whether no joint carries anything, so that all values have the unit of the command, whatever it is.
    """
    told = {j: g for j, g in zip(joints, gains, strict=True) if g is not None and g.sigma < TOLD * abs(g.value)}
    small = largest <= LARGEST_DUTY
    size = f"it never exceeds {largest:.3g}" if small else f"it reaches {largest:.3g}"
    if massless:
        return "N m", f"{size}; without masses in the URDF all values are per unit of the command, whatever it is"
    if not told and heavy and not small:
        why = f"N m would be too little for the masses of {', '.join(heavy)} in the URDF"
        return "A", f"{size}; {why}; the recording does not show how much torque it makes{_volts(largest)}"
    if not told:
        text = "volts cannot be told apart from it" if small else f"A or V would be possible{_too_large(largest)}"
        return ("duty" if small else "N m"), f"{size}; the recording does not show how much torque it makes; {text}"
    one = [joint for joint, gain in told.items() if _is_one(gain)]
    constants = ", ".join(f"{gain.value:.3g} ({joint})" for joint, gain in told.items())
    if len(one) == len(told) and (not small or len(told) > 1 or _near(next(iter(told.values())), ONE_DRIVE)):
        one_unit = f"one unit is {_range(list(told.values()))} N m on {_of(joints, told)}"
        return "N m", f"with the masses of the URDF {one_unit}{_off(told)}"
    if not small and 2 * len(one) >= len(told) and any(_is_sharply_one(told[joint]) for joint in one):
        return "N m", _beside_others(told, one)
    if small:
        return "duty", f"{size}, and one unit makes {constants} N m; volts cannot be told apart from it"
    mixed = f"; {', '.join(one)} could be N m: if so, check the masses beyond the others" if one else ""
    alike = f"; alike on all joints: or torques before gears of that ratio ({_ratio(told)})" if _all_alike(told) else ""
    others = f"{_volts(largest)}{alike}{mixed}"
    others += "; or N m, if it carries a load that the URDF lacks: --unit Nm" if _loaded(told) and not one else ""
    return "A", f"with the masses of the URDF one unit makes {constants} N m, not 1{others}"


def _of(joints: Sequence[str], told: dict[str, Value]) -> str:
    """Joints whose constant is told."""
    others = [joint for joint in joints if joint not in told]
    return "every joint" if not others else f"{', '.join(told)}; of {', '.join(others)} nothing tells it"


def _is_one(gain: Value) -> bool:
    return _near(gain, MASSES) or abs(gain.value - 1.0) < SURE * gain.sigma


def _is_sharply_one(gain: Value) -> bool:
    return abs(gain.value - 1.0) < ALIKE and gain.sigma < ALIKE


def _beside_others(told: dict[str, Value], one: Sequence[str]) -> str:
    """Why the unit is N m although some joints ask for another number."""
    unit = _range([told[joint] for joint in one])
    others = ", ".join(f"{j} asks for {g.value:.3g}" for j, g in told.items() if j not in one)
    return (
        f"with the masses of the URDF one unit is {unit} N m on {', '.join(one)}, as no current would be by chance; "
        f"{others}: masses, torques or something else that pulls there are off; if it is a current: --unit A"
    )


def _loaded(gains: dict[str, Value]) -> bool:
    """Whether a load on the last link would do the same to commands in N m: all move more than the masses say.

    The nearer a joint is to the load, the less of what it carries is in the URDF; only the first carries the whole arm.
    """
    values = [gain.value for gain in gains.values()]
    return values[0] > LOADED and all(0.0 < value < 1.0 for value in values)


def _near(gain: Value, relative: float) -> bool:
    return gain.value > 0.0 and abs(np.log(gain.value)) < np.log1p(relative)


def _all_alike(gains: dict[str, Value]) -> bool:
    """Whether all constants are one number within their sigmas."""
    values, sigmas = np.array([[g.value, g.sigma] for g in gains.values()]).T
    middle = float(np.median(values))
    return len(values) > 1 and bool(np.all(np.abs(values - middle) < np.maximum(ALIKE * middle, SURE * sigmas)))


def _ratio(gains: dict[str, Value]) -> str:
    middle = float(np.median([gain.value for gain in gains.values()]))
    return f"unit N m, scale {middle:.3g}"


def _range(gains: Sequence[Value]) -> str:
    values = [gain.value for gain in gains]
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"


def _off(gains: dict[str, Value]) -> str:
    """Joints whose constant is clearly not one, if not by much."""
    joints = [j for j, g in gains.items() if abs(g.value - 1.0) > max(ALIKE, SURE * g.sigma)]
    return (
        f"; as that is not 1, masses or torques of {', '.join(joints)} are off by as much{_or_tilted(gains)}"
        if joints
        else ""
    )


def _or_tilted(gains: dict[str, Value]) -> str:
    """A base that is not level turns the weight of several joints at once; one joint alone speaks of itself."""
    return ", or the base is not level" if len(gains) > 1 else ""


def _volts(largest: float) -> str:
    return "" if largest > LARGEST_VOLTS else "; volts look the same"


def _too_large(largest: float) -> str:
    return "" if largest <= LARGEST_VOLTS else ", volts hardly"
