# SPDX-License-Identifier: BSD-3-Clause
"""Where a refit begins with a dead zone that the curve of a spring has hidden: the same curve, seen from beyond it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.scoring.columns.gap import BEYOND, curves_of, tried_gap
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore
from jointscope.robots.dynamics.transmission import Transmission
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, beyond_gap
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

STEP = 1e-30  # of complex steps
SOFTEST = 0.05  # of the prior stiffness, the least with which a spring begins


def with_hidden_gap(robot: Robot, base: BaseModel, score: HypothesisScore | None) -> Robot:
    """The robot with a spring and a damper that begin beyond the gap of a hypothesis; as it is for all others.

    Args:
        robot: with the effect that the hypothesis adds.
        base: the model without it, whose states tell which torques the spring had.
        score: the hypothesis.
    """
    effect = None if score is None else score.hypothesis.here.effect
    if score is None or not isinstance(effect, JointTorque) or not (gap := tried_gap(effect, score.hypothesis)):
        return robot
    here, sizes = score.hypothesis.here, [size.name for size in score.hypothesis.sizes]
    stiffness, damping = (f"{here.owner}.{name}" for name in BEYOND)
    values = _curve_beyond(base, here, gap)
    found = dict(zip(sizes, score.estimate.tolist(), strict=True))
    values[stiffness] = max(values[stiffness], SOFTEST * robot.parameters[stiffness].prior)
    values[damping] = max(found[BEYOND[1]], SOFTEST * robot.parameters[damping].prior)
    return robot.with_values({name: value for name, value in values.items() if not robot.parameters[name].fixed})


def _curve_beyond(base: BaseModel, here: EffectAt, gap: tuple[float, ...]) -> dict[str, float]:
    """Stiffness and terms of the curve that give the base model's torques from the deflection beyond a gap."""
    robot = base.robot
    values = {name: parameter.value for name, parameter in robot.parameters.items()}
    d = np.concatenate([_deflection(robot, values, x, here.owner) for x in base.states])
    stiffness, curves = f"{here.owner}.{BEYOND[0]}", curves_of(robot, here)
    names, before = [stiffness], values[stiffness] * d
    columns, sigmas = [beyond_gap(d, *gap)], [robot.parameters[stiffness].prior_sigma]
    for curve in curves:
        assert isinstance(curve.effect, JointTorque)
        law, own = curve.effect.law, curve.own(values)
        before = before + np.real(law(_signals(d), own))
        nothing = dict.fromkeys(own, 0.0)
        for name in own:
            slope = law(replace(_signals(d), gap=gap), {**nothing, name: 1j * STEP})
            names.append(curve.parameter(name))
            columns.append(np.imag(slope) / STEP)
            sigmas.append(robot.parameters[names[-1]].prior_sigma)
    A = np.column_stack(columns)
    # priors keep terms that the few large deflections do not tell from running away
    weight = np.diag([1.0 / (sigma or np.inf) for sigma in sigmas]) * float(np.std(before))
    solution = np.linalg.lstsq(np.vstack([A, weight]), np.concatenate([before, np.zeros(len(names))]), rcond=None)[0]
    return dict(zip(names, map(float, solution), strict=True))


def _deflection(robot: Robot, values: dict[str, float], x: Array, joint: str) -> Array:
    """What the spring sees, shape (m,)."""
    layout, j, transmission = robot.layout, robot.joints.index(joint), Transmission.of(robot)
    seen = x if transmission is None else x @ transmission.maps(values)[0].T
    return np.asarray(seen[:, layout.joint_q[j]] - seen[:, layout.motor_q[j]])


def _signals(d: Array) -> JointSignals:
    """A spring that is bent and at rest."""
    still = np.zeros_like(d)
    return JointSignals(d, still, still, still, still, 0.0)
