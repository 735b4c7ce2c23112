# SPDX-License-Identifier: BSD-3-Clause
"""Springs behind joints that the robot file calls rigid."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.discovery import spring_trials
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.graphs.discovery.diagnosis_result import Candidate, EffectEstimate
from jointscope.graphs.discovery.spring_trials import SpringTrials, kept_by_predictions
from jointscope.graphs.judging.torque_judge import SMALL
from jointscope.graphs.refits.validation import ValidationError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

CASES = Path(__file__).parents[4] / "shared" / "cases"


@pytest.mark.skipif(not CASES.is_dir(), reason="shared/cases is not beside the project")
@pytest.mark.slow
def test_a_spring_that_the_file_does_not_know_is_found_and_nothing_is_called_adequate_without_it(tmp_path):
    path, bag = tmp_path / "e.yaml", CASES / "elastic.mcap"
    assert main(["init", str(CASES / "elastic.urdf"), str(bag), "-o", str(path)]) == 0
    robot = load_robot(path)
    found = diagnose(robot, [read_recording(bag, robot)], missing_torque=False)
    first = found.candidates[0]
    assert (first.label, first.verdict, first.refitted) == ("joint_elasticity@motor1", "missing", True)
    assert not found.adequate
    compliance = first.parameters["compliance"]
    assert compliance.value == pytest.approx(1.0 / 150.0, rel=1e-3)
    assert all(c.verdict != "missing" for c in found.candidates[1:])


def candidate(effect, verdict, error=float("nan"), share=0.9):
    return Candidate(effect, "j1", 1.0, 1, 0.0, {}, verdict, share, validation_error=error)


def trials(monkeypatch, spring, rival=float("inf"), missing=50.0, verdict="missing"):
    """What is found beside a torque that explains something, where the spring was judged so."""
    robot = SimpleNamespace(sensors={"e": 1}, transmission=None, choices=SimpleNamespace(link_dynamics="model"))
    robot.joints, robot.motor_encoder = ("j1", "j2"), SimpleNamespace(channels=("j1.p", "j2.p"))
    monkeypatch.setattr(spring_trials, "catalogue", lambda: {spring_trials.SPRING: Owners()})
    monkeypatch.setattr(spring_trials, "judge", lambda *_: spring)
    fitted = SimpleNamespace(refit=SimpleNamespace(robot="elastic"))
    monkeypatch.setattr(SpringTrials, "_fitted", lambda self, label, told: fitted)
    monkeypatch.setattr(SpringTrials, "_rival", lambda *_: rival)
    before = ValidationError(100.0, 10.0, np.array([100.0]), {"j1.p": 100.0, "j2.p": 1.0})
    tried = SpringTrials(SimpleNamespace(robot=robot), ((), ()), before, None)
    scored = SimpleNamespace(candidates=[candidate("joint_elasticity", "absent"), candidate("cogging", "absent")])
    torque = candidate("torque_offset", verdict)
    return tried.beside([torque], scored, {}, {"j1": missing, "j2": 1.0})


class Owners:
    def owners_of(self, robot):
        return robot.joints


def test_a_clear_spring_stands_before_torques(monkeypatch):
    found, refits = trials(monkeypatch, candidate("joint_elasticity", "missing", 2.0), rival=60.0)
    assert [(c.effect, c.verdict) for c in found] == [("joint_elasticity", "missing"), ("torque_offset", "possible")]
    assert refits == {"joint_elasticity@j1": "elastic"}


@pytest.mark.parametrize(
    ("share", "rival"),
    [pytest.param(0.4, np.inf, id="explains too little"), pytest.param(0.9, 1.0, id="another one explains more")],
)
def test_other_springs_are_possible_at_most(monkeypatch, share, rival):
    spring = replace(candidate("joint_elasticity", "missing", 2.0), share=share)
    found, _ = trials(monkeypatch, spring, rival)
    assert [(c.effect, c.verdict) for c in found] == [("torque_offset", "missing"), ("joint_elasticity", "possible")]


def test_joints_that_are_nearly_explained_are_not_tried(monkeypatch):
    found, refits = trials(monkeypatch, candidate("joint_elasticity", "missing", 2.0), missing=9.0)
    assert [c.effect for c in found] == ["torque_offset"] and not refits


def test_a_stiff_spring_that_takes_little_torque_is_tried_where_nothing_else_is_missing(monkeypatch):
    found, refits = trials(monkeypatch, candidate("joint_elasticity", "missing", 2.0), missing=0.2, verdict="absent")
    assert [(c.effect, c.verdict) for c in found] == [("joint_elasticity", "missing"), ("torque_offset", "absent")]
    assert refits == {"joint_elasticity@j1": "elastic"}


@pytest.mark.parametrize(
    ("effect", "after", "kept"),
    [("joint_elasticity", 19.0, True), ("joint_elasticity", 90.0, False), ("torque_offset", 19.0, False)],
)
def test_predictions_keep_springs_that_explain_most_of_their_error_and_nothing_else(effect, after, kept):
    assert kept_by_predictions(candidate(effect, "missing"), 101.0, after) is kept


def fitted(error, compliance=4e-4):
    robot = SimpleNamespace(parameters={"j1.joint_elasticity.compliance": compliance})
    return SimpleNamespace(validation=SimpleNamespace(error=error), refit=SimpleNamespace(robot=robot))


@pytest.mark.parametrize(
    ("errors", "best", "tried", "verdict"),
    [
        pytest.param((10.0,), 10.0, 1, "possible", id="a clear one is the last"),
        pytest.param((90.0, 80.0, 85.0), 80.0, 3, "possible", id="a stiffer one is better"),
        pytest.param((90.0, 95.0), 90.0, 2, "possible", id="a stiffer one is worse"),
        pytest.param((None, 80.0, None), 80.0, 3, "possible", id="not all can be calibrated"),
        pytest.param((None, None, None), None, 3, "possible", id="none can be"),
        pytest.param((90.0,), 90.0, 1, "absent", id="missing torque does not tell of it"),
    ],
)
def test_a_spring_begins_stiffer_until_that_is_no_better(monkeypatch, errors, best, tried, verdict):
    asked = []

    def fitted_from(self, label, start):
        asked.append(start["compliance"])
        error = errors[len(asked) - 1]
        return None if error is None else fitted(error)

    monkeypatch.setattr(SpringTrials, "_fitted_from", fitted_from)
    before = ValidationError(100.0, 10.0, np.array([100.0]), {})
    sizes = {"compliance": EffectEstimate(9e-4, 1e-4, "rad/(N m)"), "damping": EffectEstimate(2.0, 1.0, "N m s/rad")}
    told = replace(candidate("joint_elasticity", verdict), parameters=sizes)
    found = SpringTrials(SimpleNamespace(), ((), ()), before, None)._fitted(told.label, told)
    assert (None if found is None else found.validation.error) == best
    assert asked == pytest.approx([9e-4, 3e-4, 1e-4][:tried])


@pytest.mark.parametrize(
    ("share", "reason", "sigma", "after", "verdict"),
    [
        pytest.param(0.8, SMALL, 1e-5, 100.0, "missing", id="most of what its joint lacks"),
        pytest.param(0.4, SMALL, 1e-5, 100.0, "absent", id="less than that"),
        pytest.param(0.8, "it helps on 3 of 10", 1e-5, 100.0, "absent", id="refused for another reason"),
        pytest.param(0.8, SMALL, 3e-4, 100.0, "absent", id="not sure"),
        pytest.param(0.8, SMALL, 1e-5, 110.0, "absent", id="predictions are worse"),
    ],
)
def test_a_small_spring_is_kept_if_it_is_most_of_the_torque_and_sure(share, reason, sigma, after, verdict):
    sizes = {"compliance": EffectEstimate(4e-4, sigma, "rad/(N m)")}
    judged = replace(candidate("joint_elasticity", "absent", after), parameters=sizes, refitted=True)
    told = {judged.label: replace(judged, verdict="possible", share=share, reasons=(reason,))}
    before = ValidationError(100.0, 10.0, np.array([100.0]), {})
    assert spring_trials._small_and_sure(judged, told, before).verdict == verdict
