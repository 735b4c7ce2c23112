# SPDX-License-Identifier: BSD-3-Clause
"""Values that a calibration found: the free parameters, what a user must know of each, and what follows from them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibration_result import ParameterEstimate
from jointscope.robots.effect_kinds.command_effect import CommandEffect
from jointscope.robots.model.robot import Robot
from jointscope.robots.model.structured_tree import StructuredTree
from jointscope.robots.parts.derived import Derived
from jointscope.robots.parts.parameter import Parameter

Array = NDArray[np.float64]

HELD_BY_PRIOR = 0.7  # share of the prior's sigma from which a value is called held by its prior
FROM_ZERO = 0.5  # sigma over a value of either sign up to which it differs from zero
NEAR_ZERO = 0.5  # relative sigma from which a positive value is called compatible with zero
FALLEN = 0.1  # of its prior, below which such a value has run into its bound
SURELY_BELOW = 3.5  # [sigma] below null from which a value of one sign has the other one
AT_BOUND = "at its bound: compatible with zero"
NEAR_BOUND = "compatible with zero, its bound"
WRONG_SIDE = "below zero, where it has no meaning: it stands for something else"
STAMPED_LATE = "the measured drive signal is filtered or stamped late"


def dynamic_parameters(robot: Robot, calibration: Calibration, sigmas: Array) -> list[ParameterEstimate]:
    """The free parameters with notes.

    A positive value that ran into its bound has the sigma that it would have at its prior: a damping of 0.8 N m s/rad
    of which the recording told little came out as 0.008 +- 0.018.

    Args:
        robot: before the calibration.
        calibration: the values that were found.
        sigmas: of the shared values, the parameters' coordinates first.
    """
    found, slopes, one_sided = [], calibration.value_by_coordinate, _one_sided(robot)
    for i, name in enumerate(calibration.names):
        p, value, sigma = robot.parameters[name], float(calibration.values[i]), float(sigmas[i] * slopes[i])
        note = _note(p, value, sigma, float(sigmas[i]))
        if note == AT_BOUND:  # near zero a logarithm's slope is as small as the value, and so would be its sigma
            sigma = float(sigmas[i]) * p.prior
        if not note and name in one_sided and value < one_sided[name] - SURELY_BELOW * sigma:
            note = _stamped_late(p, value) if name in _measured_times(robot) else WRONG_SIDE
        found.append(ParameterEstimate(name, value, sigma, p.unit, p.value, p.prior, p.prior_sigma, p.published, note))
    return found


def _one_sided(robot: Robot) -> dict[str, float]:
    """Null values of effects' sizes of which only those above null are physical, by the parameter's name."""
    return {
        here.parameter(p.name): p.null
        for here in robot.effects
        for p in here.effect.parameters_at(robot, here.owner)
        if p.sign == "+" and not p.is_shape
    }


def _measured_times(robot: Robot) -> set[str]:
    """Full names of the times by which effects make a drive signal late that was measured; none of commands.

    What was measured may have been filtered, or sent late: the torque then acts before the stamp.
    """
    return {
        here.parameter(p.name)
        for here in robot.effects
        if isinstance(here.effect, CommandEffect) and not robot.command_held
        for p in here.effect.parameters
        if p.unit == "s"
    }


def _stamped_late(p: Parameter, value: float) -> str:
    """What a delay below its null value says of a measured drive signal [s]."""
    return f"{STAMPED_LATE}, by {1e3 * ((p.null or 0.0) - value):.3g} ms"


def says_what_it_means(note: str) -> bool:
    """Whether a note explains a value that is in no doubt."""
    return note.startswith(STAMPED_LATE)


def _note(p: Parameter, value: float, sigma: float, of_coordinate: float) -> str:
    """What the prior or the bound at zero has to do with a value."""
    small = p.positive and sigma > NEAR_ZERO * value
    if small and value < FALLEN * p.prior:
        return AT_BOUND
    if of_coordinate > HELD_BY_PRIOR * p.coordinate_sigma:
        return "held by its prior"
    return NEAR_BOUND if small else ""


def share_of_value(robot: Robot, p: ParameterEstimate) -> float | None:
    """Standard deviation over the size of a value; None of a value near zero that is known well.

    A lever of 0.1 +- 0.1 mm is known: its sign is free, zero is as likely, and its prior has a say in it no more. One
    with a sigma as large as that of its prior is not.

    Args:
        robot: says which values have one sign.
        p: a parameter of it.
    """
    share = p.sigma / max(abs(p.value), 1e-300)
    one_sign = p.name in robot.parameters and robot.parameters[p.name].positive
    held = p.prior_sigma > 0.0 and p.sigma > HELD_BY_PRIOR * p.prior_sigma
    return share if share <= FROM_ZERO or one_sign or held else None


def derived_results(robot: Robot, calibration: Calibration, covariance: Array) -> tuple[ParameterEstimate, ...]:
    """All derived results of a robot.

    Args:
        robot: before the calibration.
        calibration: the values that were found.
        covariance: of the shared values, whose first ones are the free parameters' coordinates, shape (s, s).
    """
    before = robot.values
    now = before | calibration.by_name
    count = len(calibration.names)
    scale = np.asarray(calibration.value_by_coordinate)
    of_values = covariance[:count, :count] * np.outer(scale, scale)
    found = []
    for result in robot.derived:
        value, slopes = derived_value(robot, result, now)
        by = np.array([slopes.get(name, 0.0) for name in calibration.names])
        sigma, start = float(np.sqrt(by @ of_values @ by)), derived_value(robot, result, before)[0]
        found.append(ParameterEstimate(result.name, value, sigma, result.unit, start, start, 0.0, derived=True))
    return tuple(found)


def derived_value(robot: Robot, result: Derived, values: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """A derived result and its derivative by each parameter that it follows from.

    Args:
        robot: the robot.
        result: one of its derived results.
        values: all parameters by full name.
    """
    if result.of:
        return sum(factor * values[name] for name, factor in result.of.items()), dict(result.of)
    tree, layout = StructuredTree(robot), robot.layout
    q = np.zeros((1, layout.n_link))
    q[0, layout.joint_link] = result.at
    factors = np.zeros(layout.n_link)
    for joint, factor in result.gravity.items():
        factors[layout.joint_link[robot.joints.index(joint)]] = factor
    still = np.zeros_like(q)
    value = float(tree.bodies(values).torque(q, still, still)[0] @ factors)
    return value, {name: float(by[0] @ factors) for name, by in tree.gravity_by_parameter(q, values).items()}
