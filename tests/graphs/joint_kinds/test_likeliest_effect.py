# SPDX-License-Identifier: BSD-3-Clause
"""Trials of effects of an arm: one that leads it past its targets is no candidate, and no error of the recordings."""

from types import SimpleNamespace

import pytest

from jointscope.graphs.joint_kinds import likeliest_effect as module
from jointscope.robots.errors import RecordingError, SolveError


@pytest.fixture
def race(monkeypatch):
    """Two leading effects, the first of which fails as it is told to."""

    def run(error):
        def calibrated(robot, sessions, recordings, near=False, most=0, passes=0):
            if robot == "wild":
                raise error("the arm misses the measured targets by 58.7 mm")
            return SimpleNamespace(robot=robot)

        monkeypatch.setattr(module, "calibrated", calibrated)
        monkeypatch.setattr(module, "_unlikely", lambda found, base: 0.0 if found.robot == "base" else -50.0)
        kind = SimpleNamespace(orders=())
        leading = [SimpleNamespace(hypothesis=SimpleNamespace(label=label, kind=kind)) for label in ("wild", "payload")]
        begins = {"wild": "wild", "payload": "payload"}
        base = SimpleNamespace(robot="base")
        return module.likeliest_effect(base, leading, begins, (), ("shaken",), lambda text, share: None)

    return run


@pytest.mark.parametrize("error", [RecordingError, SolveError])
def test_an_effect_that_no_recording_allows_leaves_the_field_to_the_others(race, error):
    candidate, found = race(error)
    assert candidate.hypothesis.label == "payload" and found.robot == "payload"


def test_what_is_no_failure_of_a_trial_is_not_swallowed(race):
    with pytest.raises(ValueError, match="misses"):
        race(ValueError)
