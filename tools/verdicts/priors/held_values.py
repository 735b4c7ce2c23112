# SPDX-License-Identifier: BSD-3-Clause
"""Do the values come from the recordings, or from priors and bounds?"""

from __future__ import annotations

from jointscope.graphs.calibration.calibration_result import CalibrationResult, ParameterEstimate
from jointscope.graphs.calibration.found_values import says_what_it_means
from jointscope.robots.geometry.error_parameters import is_geometry
from jointscope.robots.model.robot import Robot

HELD = 0.7  # a sigma of more than this share of the prior's tells that the data said little
UNDETERMINED = 0.5  # relative sigma from which nothing is known
SHOWN = 3
HELD_NOTE = "held by its prior"


def is_held(parameter: ParameterEstimate) -> bool:
    """Whether the prior, not the recording, determines a parameter."""
    return parameter.prior_sigma > 0.0 and parameter.sigma > HELD * parameter.prior_sigma


def is_mounting_or_bias(parameter: ParameterEstimate) -> bool:
    """Whether it describes how a sensor sits, not how the robot moves."""
    return any(part in parameter.name for part in (".R_imu_body", ".bias", ".lever_"))


def values_from_data(result: CalibrationResult) -> tuple[str, str]:
    """Level and sentence.

    "bad" where a guess of the robot file came back as a value, "warn" where a prior or a bound has a say, "info" where
    that is a sensor's mounting or what an effect leaves to its prior on purpose.
    """
    noted = [p for p in result.parameters if (p.note and not says_what_it_means(p.note)) or is_held(p)]
    if not noted:
        return "good", "No parameter leans on its prior or lies on a bound."
    meant = left_to_priors(result.robot)
    dynamic = [p for p in noted if not is_mounting_or_bias(p) and not is_geometry(p.name)]
    doubtful = [p for p in dynamic if not (p.name in meant and _only_held(p))]
    if guessed := _guessed(result, doubtful):
        return "bad", guessed
    if not doubtful and dynamic:
        return "info", f"{_listed(dynamic)}, as the effect allows: the sigmas of its other values include that."
    return "warn" if doubtful else "info", f"{_listed(doubtful or noted)}."


def left_to_priors(robot: Robot) -> set[str]:
    """Parameters that only shape an effect and that its file declares weak.

    Their priors are knowledge, and no recording need move them: how often an encoder's error comes back per turn, the
    inertia of a body across its bearing.
    """
    return {
        here.parameter(p.name)
        for here in robot.effects
        for p in here.effect.parameters_at(robot, here.owner)
        if p.weak and p.is_shape
    }


def _only_held(parameter: ParameterEstimate) -> bool:
    return parameter.note in ("", HELD_NOTE)


def _guessed(result: CalibrationResult, doubtful: list[ParameterEstimate]) -> str:
    """What to say of values of the base model of which the recordings tell nothing; empty where there are none."""
    known = result.robot.parameters
    guessed = [p for p in doubtful if is_held(p) and p.name in known and known[p.name].null is None]
    guessed = [p for p in guessed if p.sigma > UNDETERMINED * abs(p.value)]
    if not guessed:
        return ""
    joints = ", ".join(dict.fromkeys(p.name.rsplit(".", 1)[0] for p in guessed))
    return (
        f"The recordings determine nothing about {', '.join(p.name for p in guessed[:4])}"
        f"{f' and {len(guessed) - 4} more' if len(guessed) > 4 else ''}: what stands there is a guess of the robot "
        f"file, and so is its sigma. Hold one value of {joints} that you know with `fixed: true`, or leave the "
        "joint out of the robot."
    )


def _listed(parameters: list[ParameterEstimate]) -> str:
    text = "; ".join(f"{p.name}: {p.note or HELD_NOTE}" for p in parameters[:SHOWN])
    return f"{text} and {len(parameters) - SHOWN} more" if len(parameters) > SHOWN else text
