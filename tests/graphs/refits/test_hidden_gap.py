# SPDX-License-Identifier: BSD-3-Clause
"""A spring behind a gap that its curve hid: where a refit begins, against torques worked out by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.refits.refit import with_hidden_gap
from jointscope.graphs.scoring.columns.gap import curves_of
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.robots.effect_kinds.effect import EffectParameter
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

JOINT, GAP = "joint2", 0.01  # [rad]
LAWS = {
    "spring_pieces_2": {"forward": 0.05, "backward": 0.05},
    "spring_pieces_1": {"forward_1": 1.0, "backward_1": 1.0, "forward": 0.05, "backward": 0.05},
    "spring_limit": {"stiffness": 300.0, "forward": 0.03, "backward": 0.02},
}


def shape(law, d):
    """Torque over stiffness of the part that lies beyond a gap: a straight line, or one whose slope doubles."""
    return d + d * np.abs(d) / 0.1 if law == "spring_pieces_1" else d


@pytest.mark.parametrize("law", LAWS)
def test_a_curve_keeps_its_knots_and_lengths_and_the_stiffness_makes_up_for_the_gap(law):
    robot = add_effect(load_robot("doggy"), f"{law}@{JOINT}", LAWS[law])
    here = EffectAt(catalogue()["backlash"], JOINT)
    assert [other.label for other in curves_of(robot, here)] == [f"{law}@{JOINT}"]
    j, K = robot.joints.index(JOINT), robot.values[f"{JOINT}.stiffness"]
    d, x = np.linspace(-0.05, 0.05, 401), np.zeros((401, robot.layout.size))
    x[:, robot.layout.joint_q[j]] = d
    sizes = tuple(EffectParameter(name, "1", 1.0, 1.0) for name in ("stiffness", "damping"))
    found = EffectHypothesis(here, sizes, {"half_gap": GAP})
    score = SimpleNamespace(hypothesis=found, estimate=np.array([K, 1.0]))
    with_gap = add_effect(robot, f"backlash@{JOINT}", {"half_gap": GAP})
    new = with_hidden_gap(with_gap, SimpleNamespace(robot=robot, states=[x]), score).values
    # the same torque over the same deflections from what is beyond the gap, by least squares
    before, beyond = shape(law, d), shape(law, np.sign(d) * np.maximum(np.abs(d) - GAP, 0.0))
    assert new[f"{JOINT}.stiffness"] == pytest.approx(K * (before @ beyond) / (beyond @ beyond), rel=0.01)
    for name, value in robot.values.items():
        if name.startswith(f"{JOINT}.{law}."):
            assert new[name] == value
