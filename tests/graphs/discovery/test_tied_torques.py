# SPDX-License-Identifier: BSD-3-Clause
"""Candidates whose torques are the same in a recording stand in an order that no rounding decides."""

import pytest

from jointscope.graphs.discovery.diagnosis_result import Candidate
from jointscope.graphs.discovery.torque_verdicts import _simplest_first


def order(scores, verdict="missing"):
    best = max(scores.values())
    found = [Candidate(effect, "j", s, 1, 0.0, {}, verdict) for effect, s in scores.items()]
    return [c.effect for c in sorted(found, key=lambda c: _simplest_first(c, c.score, best))]


@pytest.mark.parametrize("more", [1e-9, -1e-9])
def test_the_simplest_of_equals_comes_first_whatever_rounding_says(more):
    scores = {"gravity_imbalance": 700.0, "asymmetric_friction": 700.0 + more, "torque_offset": 700.0}
    assert order(scores) == ["torque_offset", "asymmetric_friction", "gravity_imbalance"]


def test_a_clearly_better_one_comes_first_though_it_is_less_simple():
    assert order({"torque_offset": 650.0, "asymmetric_friction": 700.0}) == ["asymmetric_friction", "torque_offset"]
