# SPDX-License-Identifier: BSD-3-Clause
"""Candidates whose torques are the same in a recording stand in an order that no rounding decides."""

import pytest

from jointscope.graphs.discovery.diagnosis_result import Candidate
from jointscope.graphs.discovery.torque_verdicts import _simplest_first


def order(scores, verdict="missing"):
    found = [Candidate(effect, "j", s, 1, 0.0, {}, verdict) for effect, s in scores.items()]
    return [c.effect for c in _simplest_first(found, {c.label: c.score for c in found})]


@pytest.mark.parametrize("more", [1e-9, -1e-9])
def test_the_simplest_of_equals_comes_first_whatever_rounding_says(more):
    scores = {"gravity_imbalance": 700.0, "asymmetric_friction": 700.0 + more, "torque_offset": 700.0}
    assert order(scores) == ["torque_offset", "asymmetric_friction", "gravity_imbalance"]


def test_a_clearly_better_one_comes_first_though_it_is_less_simple():
    assert order({"torque_offset": 650.0, "asymmetric_friction": 700.0}) == ["asymmetric_friction", "torque_offset"]


def test_a_late_drive_comes_before_clocks_that_say_the_same():
    scores = {"clock_offset": 14021.0, "encoder_delay": 14021.0, "command_delay": 13649.0, "motor_lag": 13600.0}
    assert order(scores) == ["command_delay", "motor_lag", "clock_offset", "encoder_delay"]
    early = {"clock_offset": 14021.0, "encoder_delay": 14020.0}  # no drive acts before it is told
    assert order(early) == ["clock_offset", "encoder_delay"]
