# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on a calibration from frequency responses: what each check says, and from where on."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.frequency.agreement import Agreement
from jointscope.graphs.frequency.explained import Answered, Explained, PoseFit
from jointscope.robots.parts.parameter import Parameter
from jointscope.tools.verdicts.frequency_judgement import judge_frequency


def pose(share=0.02, over_noise=1.2, by_realisations=True):
    band = Answered(20.0, 30.0, share, 0.02)
    noise = None if over_noise is None else np.array([over_noise])
    return PoseFit("P1", np.array([0.004]), noise, (Answered(1.0, 20.0, 0.0, 0.02), band), by_realisations)


def judged(
    the_pose=None, poses=None, realisations=None, heldout=1.01, silent=(), sharp=0.01, settled=True, parameters=None
):
    """The checks by name, of a calibration that is good but for what is given."""
    fine = Agreement(20.0, 22)
    found = Explained(
        (the_pose or pose(),),
        {"P1": fine} if poses is None else poses,
        {0: fine, 1: fine} if realisations is None else realisations,
        {} if heldout is None else {0: heldout, 1: 1.0},
        {} if heldout is None else {0: 1.0, 1: 1.0},
    )
    names = ("joint1.friction_sharpness",)
    problem = SimpleNamespace(pose=SimpleNamespace(path="P1", matrix=SimpleNamespace(each=(0, 1))))
    told = names if sharp < 0.1 else ()
    result = SimpleNamespace(
        explained=found,
        silent=silent,
        names=names,
        told=told,
        problems=(problem,),
        settled=settled,
        stages=4,
        robot=SimpleNamespace(parameters={} if parameters is None else parameters, effects=()),
        start=SimpleNamespace(path=Path("arm.yaml")),
    )
    verdict = judge_frequency(result)
    return verdict, {check.name: check for check in verdict.checks}


def test_a_calibration_that_explains_its_recordings_is_good():
    verdict, checks = judged()
    assert verdict.level == "good" and verdict.headline == "Yes, this calibration is good."
    assert all(check.level in ("good", "info") for check in checks.values())


@pytest.mark.parametrize(("share", "level"), [(0.05, "good"), (0.3, "warn"), (0.7, "bad")])
def test_a_response_that_is_left_over_is_said_with_its_frequencies(share, level):
    verdict, checks = judged(pose(share))
    check = checks["No response is left over"]
    assert verdict.level == check.level == level
    assert level == "good" or "P1, 20 to 30 Hz" in check.text


def test_with_one_realisation_lines_are_compared():
    assert "at neighbouring lines" in judged(pose(0.7, by_realisations=False))[1]["No response is left over"].text


def test_friction_beyond_its_law_is_no_fault_and_one_period_tells_no_noise():
    name = "What is left against the noise"
    assert judged(pose(over_noise=1.2))[1][name].level == "good"
    assert "50 times the power of the noise: friction" in judged(pose(over_noise=50.0))[1][name].text
    assert "one period shows no noise" in judged(pose(over_noise=None))[1][name].text


@pytest.mark.parametrize(("error", "level"), [(1.05, "good"), (1.3, "warn"), (2.0, "bad")])
def test_a_realisation_that_the_others_do_not_predict_is_a_warning(error, level):
    assert judged(heldout=error)[0].level == level


def test_poses_that_tell_other_values_are_named():
    verdict, checks = judged(poses={"P1": Agreement(90.0, 22), "P3": Agreement(15.0, 22)})
    text = checks["Recordings that agree on the values"].text
    assert verdict.level == "bad" and "others: P1, chi-square 90.0 for 22" in text and "P3" not in text


def test_one_recording_has_nothing_to_be_compared_with():
    verdict, checks = judged(poses={}, realisations={}, heldout=None)
    assert verdict.level == "good"
    assert "nothing to compare" in checks["Recordings that agree on the values"].text
    assert "record another" in checks["A realisation that others predict"].text


def test_a_drive_that_is_not_told_is_a_reservation_and_a_damper_is_not():
    assert judged(silent=("joint1.stiffness",))[0].level == "warn"
    assert judged(silent=("joint2.bearing.damping_x",))[0].level == "good"


def test_friction_that_may_stick_is_a_reservation():
    verdict, checks = judged(sharp=0.4)
    assert verdict.level == "warn" and "turns over faster" in checks["Friction that is known"].text


def test_iterations_that_do_not_come_to_rest_are_a_no():
    verdict, checks = judged(settled=False)
    assert verdict.level == "bad"
    assert [name for name, check in checks.items() if check.level == "bad"] == ["Values that came to rest"]


def test_a_value_far_from_its_prior_is_a_no():
    name = "joint1.friction_sharpness"
    far = Parameter(name, 2000.0, "s/rad", 20.0, 2.0, sigma=1.0)
    verdict, checks = judged(parameters={name: far})
    assert verdict.level == "bad"
    assert "46 sigma from its prior of 20.0 ± 2.0" in checks["Values where their priors expect them"].text
