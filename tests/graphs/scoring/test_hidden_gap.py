# SPDX-License-Identifier: BSD-3-Clause
"""A dead zone that a spring's polynomial has swallowed is tried as a corner, and its refit begins beyond it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.refits.refit import with_hidden_gap
from jointscope.graphs.scoring.columns.gap import curves_of, gap_hypotheses
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

HALF, K, K2, K3, D = 0.4, 0.42, -0.1, 0.5, 0.01


@pytest.fixture(scope="module")
def swallowed():
    """BioRob whose polynomial was fitted to joint 1 behind a dead zone, and states that bend it both ways."""
    arm = load_robot("biorob")
    d = np.linspace(-1.2, 1.2, 401)
    z = np.sign(d) * np.maximum(np.abs(d) - HALF, 0.0)
    tau = K * z + K2 * z**2 + K3 * z**3
    k, k2, k3 = np.linalg.lstsq(np.column_stack([d, d**2, d**3]), tau, rcond=None)[0]
    names = ("joint1.stiffness", "joint1.spring_curve.quadratic", "joint1.spring_curve.cubic")
    robot = arm.with_values(dict(zip(names, (max(k, 1e-3), k2, k3), strict=True)))
    x = np.zeros((len(d), robot.layout.size))
    x[:, robot.layout.joint_q[0]] = d * robot.transmission[0, 0]
    return robot, x


def test_gaps_are_tried_where_a_curve_may_hide_them_and_over_the_deflections_that_occur(swallowed):
    robot, x = swallowed
    signals = SimpleNamespace(robot=robot, model=SimpleNamespace(layout=robot.layout), seen=x)
    seen = np.zeros_like(x)
    seen[:, robot.layout.joint_q[0]] = np.linspace(-1.2, 1.2, len(x))
    signals.seen = seen
    found = gap_hypotheses([signals])
    assert {h.here.owner for h in found} == {"joint1", "joint2"}  # springs 3 and 4 are straight
    gaps = [h.shapes["half_gap"] for h in found if h.here.label == "backlash@joint1"]
    assert min(gaps) < 0.1 < HALF < max(gaps) < 1.2
    slack = [(h.shapes["backward"], h.shapes["forward"]) for h in found if h.here.label == "spring_slack@joint1"]
    assert slack == [(gap, 0.0) for gap in gaps] + [(0.0, gap) for gap in gaps]  # of either rope alone
    doggy = load_robot("doggy")
    assert curves_of(doggy, EffectAt(catalogue()["backlash"], "joint1")) == []


def test_a_refit_begins_with_the_curve_seen_from_beyond_the_gap(swallowed):
    robot, x = swallowed
    here = EffectAt(catalogue()["backlash"], "joint1")
    sizes = tuple(SimpleNamespace(name=name) for name in ("stiffness", "damping"))
    hypothesis = SimpleNamespace(here=here, sizes=sizes, shapes={"half_gap": HALF})
    score = SimpleNamespace(hypothesis=hypothesis, estimate=np.array([0.1, D]))
    base = SimpleNamespace(robot=robot, states=[x])
    found = with_hidden_gap(add_effect(robot, here.label, {"half_gap": HALF}), base, score).parameters
    assert found["joint1.damping"].value == D
    z = np.array([0.2, 0.5, 0.8])
    k, k2, k3 = (found[f"joint1.{n}"].value for n in ("stiffness", "spring_curve.quadratic", "spring_curve.cubic"))
    np.testing.assert_allclose(k * z + k2 * z**2 + k3 * z**3, K * z + K2 * z**2 + K3 * z**3, rtol=0.2)
    assert robot.parameters["joint1.stiffness"].value < 0.3 * K < 0.7 * K < k  # the polynomial had it all wrong


def test_other_hypotheses_begin_where_they_did(swallowed):
    robot, x = swallowed
    assert with_hidden_gap(robot, SimpleNamespace(robot=robot, states=[x]), None) is robot
