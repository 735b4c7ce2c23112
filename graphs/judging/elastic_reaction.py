# SPDX-License-Identifier: BSD-3-Clause
r"""What the motor of a joint feels of a load that swings behind an unseen spring.

A rigid joint transmits the torque tau that its load needs for the motion of the motor. With a spring and a damper
between them the load follows late and overshoots,

    tau_spring(s) = (2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2) tau(s),   w^2 = K / J,  2 zeta w = D / J

so that a rigid model lacks s^2 / (s^2 + 2 zeta w s + w^2) tau: far below the resonance a torque that grows with the
square of the frequency, no matter how little of the resonance itself is excited. The share of tau that swings is the
size, frequency and damping are shapes. The inertia J is taken as constant, and no other joint feels the difference.

Reference: Spong (1987), Modeling and control of elastic joint robots, J. Dynamic Systems, Measurement, and Control
109(4), eq. (8), for one joint.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from jointscope.graphs.judging.torque_steps import TorqueSteps
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.robots.effect_kinds.effect import EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.model.robot import Robot

Array = NDArray[np.float64]

SHARE = EffectParameter("share", "1", start=1.0, prior_sigma=3.0, sign="+")
SLOWEST, FASTEST, FREQUENCIES = 3.0, 80.0, 42  # [Hz], 8 % apart
PER_PERIOD = 6.0  # samples of the fastest resonance that is tried
DAMPING_RATIOS = (0.01, 0.03, 0.1, 0.3)
SLOPE = 1e-3  # relative step of a shape


def is_spring(hypothesis: EffectHypothesis) -> bool:
    """Whether a hypothesis puts a spring into a rigid joint."""
    effect = hypothesis.here.effect
    return isinstance(effect, Structure) and effect.form == "elasticity"


def spring_hypotheses(here: EffectAt, period: float) -> list[EffectHypothesis]:
    """Springs of many resonances and dampings.

    Args:
        here: the effect at its joint.
        period: of the ticks [s].
    """
    highest = min(FASTEST, 1.0 / (PER_PERIOD * period))
    frequencies = np.geomspace(SLOWEST, FASTEST, FREQUENCIES)
    pairs = product(frequencies[frequencies <= highest], DAMPING_RATIOS)
    return [EffectHypothesis(here, (SHARE,), {"frequency": float(f), "damping_ratio": z}) for f, z in pairs]


def reaction_column(steps: TorqueSteps, hypothesis: EffectHypothesis) -> Array:
    """Torque that a rigid model lacks in its steps if all of the load swings, shape (m, r, 1) [N m]."""
    from scipy.signal import cont2discrete, lfilter

    s, joint = steps.segment.signals, hypothesis.here.owner
    row = int(s.model.layout.joint_link[s.robot.joints.index(joint)])
    q, v, a = s.x[:, s.model.layout.q_link], s.x[:, s.model.layout.v_link], s.rate[:, s.model.layout.v_link]
    tau = s.robot.kinematic_tree.torque(q, v, a)[:, row]
    w, zeta = 2.0 * np.pi * hypothesis.shapes["frequency"], hypothesis.shapes["damping_ratio"]
    period = float(np.median(np.diff(s.ticks)))
    numerator, denominator, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2.0 * zeta * w, w * w]), period, "foh")
    lacking = lfilter(np.ravel(numerator), denominator, tau - tau[0])  # what hangs still at first swings in no way
    found = np.zeros((len(tau) - 1, steps.missing.shape[1], 1))
    found[:, row, 0] = 0.5 * (lacking[1:] + lacking[:-1])
    return found


def known_springs(elastic: Robot, rigid: Robot) -> list[EffectHypothesis]:
    """Each spring of a robot as its reaction on the motors of the same robot without springs, with its shapes."""
    found = []
    for here in elastic.effects:
        if not (isinstance(here.effect, Structure) and here.effect.form == "elasticity"):
            continue
        inertia = _inertia(rigid, here.owner)
        compliance, damping = (elastic.parameters[here.parameter(name)].value for name in ("compliance", "damping"))
        w = 1.0 / np.sqrt(inertia * compliance)
        shapes = {"frequency": w / (2.0 * np.pi), "damping_ratio": damping / (2.0 * w * inertia)}
        found.append(EffectHypothesis(here, (SHARE,), {name: float(value) for name, value in shapes.items()}))
    return found


def beside_springs(steps: TorqueSteps, springs: Sequence[EffectHypothesis]) -> TorqueSteps:
    """What is still missing in the steps of a rigid model where springs swing, and how it changes with these.

    Logarithms of frequency and damping ratio of each spring stand behind the base parameters.
    """
    for spring in springs:
        slopes = []
        for name, value in spring.shapes.items():
            ends = [replace(spring, shapes={**spring.shapes, name: value * np.exp(d)}) for d in (SLOPE, -SLOPE)]
            more, less = (reaction_column(steps, end) for end in ends)
            slopes.append((more - less) / (2.0 * SLOPE))
        left = steps.missing - reaction_column(steps, spring)[:, :, 0]
        steps = replace(steps, missing=left, base=np.concatenate([steps.base, *slopes], axis=2))
    return steps


def spring_start(robot: Robot, hypothesis: EffectHypothesis) -> Mapping[str, float]:
    """Compliance [rad/(N m)] and damping [N m s/rad] for the inertia that the joint moves at zero angles."""
    inertia = _inertia(robot, hypothesis.here.owner)
    w, zeta = 2.0 * np.pi * hypothesis.shapes["frequency"], hypothesis.shapes["damping_ratio"]
    return {"compliance": 1.0 / (inertia * w * w), "damping": 2.0 * zeta * w * inertia}


def _inertia(robot: Robot, joint: str) -> float:
    """What a joint moves at zero angles [kg m2]."""
    j = robot.joints.index(joint)
    return float(robot.tree.mass_matrix(np.zeros((1, robot.n)))[0, j, j])
