# SPDX-License-Identifier: BSD-3-Clause
"""Verdicts and their reasons from made-up scores and errors; nothing is solved."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.discovery.diagnosis_result import Candidate, EffectEstimate
from jointscope.graphs.discovery.diagnosis_words import part_in_words
from jointscope.graphs.discovery.scored_candidates import ScoredCandidate
from jointscope.graphs.discovery.verdicts import excess_share, judge, standing_in, worth_a_refit
from jointscope.graphs.refits.left_out import Missed
from jointscope.graphs.refits.validated_refit import ValidatedRefit
from jointscope.graphs.refits.validation import ValidationError
from jointscope.graphs.scoring.columns.hypotheses import EffectHypothesis
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot

DOGGY = load_robot("doggy")
SECONDS = 10.0
BLOCKS = 5


def score(label, estimate, sigma):
    """The score of one hypothesis whose sizes do not depend on each other."""
    effect, owner = label.split("@")
    sizes = tuple(p for p in catalogue()[effect].parameters_of(DOGGY, owner) if not p.is_shape)
    estimate, sigma = np.array(estimate, float), np.array(sigma, float)
    S = np.diag(1.0 / sigma**2)
    hypothesis = EffectHypothesis(EffectAt(catalogue()[effect], owner), sizes)
    return HypothesisScore(hypothesis, float(estimate @ S @ estimate), estimate, sigma, S, -S @ estimate)


def scored(label="motor_viscous@joint2", estimate=(2.0,), sigma=(0.1,), chance=1e-9, p_value=1e-6):
    best = score(label, estimate, sigma)
    return ScoredCandidate(best, best.plausible[0], p_value, chance, ())


def errors(error, better=BLOCKS, before=4.0):
    """Errors with `better` of five blocks below and the others above those of the base model."""
    by_span = np.where(np.arange(BLOCKS) < better, 0.5 * before, 2.0 * before)
    return ValidationError(error, error, by_span, {})


BASE = ValidationError(4.0, 4.0, np.full(BLOCKS, 4.0), {})


def refitted(error, value=2.0, sigma=0.1, better=BLOCKS):
    robot = add_effect(DOGGY, "motor_viscous@joint2", {"coefficient": value})
    fit = SimpleNamespace(robot=robot, sigmas={"coefficient": sigma}, converged=True)
    return ValidatedRefit(fit, errors(error, better), 1.7)


def verdict(candidate, validated=None):
    found = judge(candidate, BASE, validated, SECONDS)
    return found.verdict, found.reasons


def test_an_effect_that_lowers_the_error_on_all_blocks_is_missing():
    assert verdict(scored(), refitted(2.0)) == (
        "missing",
        ("the error on validation blocks falls from 4 to 2 sigma", "it helps on 5 of 5 validation blocks"),
    )


def test_an_effect_that_harms_one_block_badly_may_stand_in_for_something_else():
    quiet = ValidationError(4.0, 4.0, np.array([1.5, 4.0, 4.0, 4.0, 6.0]), {})
    harmful = refitted(2.0)
    by_span = np.array([6.0, 2.0, 2.0, 2.0, 2.0])
    harmful = ValidatedRefit(harmful.refit, ValidationError(2.0, 2.0, by_span, {}), 1.7)
    found = judge(scored(), quiet, harmful, SECONDS)
    said = "on one of them it makes the error 4.0 times larger: it may stand in for something else"
    assert (found.verdict, found.reasons[2:]) == ("missing", (said,))


def test_an_effect_that_leaves_the_error_where_it_is_is_absent():
    expected = ("with it the error on validation blocks goes from 4 to 3.97 sigma",)
    assert verdict(scored(), refitted(3.97)) == ("absent", expected)


def test_an_effect_that_raises_the_error_is_absent():
    assert verdict(scored(), refitted(5.0))[0] == "absent"


def test_a_prediction_that_runs_away_makes_an_effect_absent():
    found = judge(scored(), BASE, refitted(float("nan")), SECONDS)
    assert found.verdict == "absent"
    assert np.isnan(found.bic)


def test_a_refit_with_the_impossible_sign_is_absent():
    found, reasons = verdict(scored(), refitted(2.0, value=-2.0))
    assert (found, reasons[-1]) == ("absent", "but coefficient comes out with the impossible sign")


def test_a_size_within_three_sigma_of_null_is_only_possible():
    found, reasons = verdict(scored(), refitted(2.0, value=0.2, sigma=0.1))
    assert (found, reasons[-1]) == ("possible", "but no size is 3 sigma away from null")


def test_help_on_less_than_three_of_five_blocks_is_only_possible():
    expected = "but not on enough of them, or not enough for its parameters"
    assert verdict(scored(), refitted(2.0, better=2)) == (
        "possible",
        ("the error on validation blocks falls from 4 to 2 sigma", "it helps on 2 of 5 validation blocks", expected),
    )
    assert verdict(scored(), refitted(2.0, better=3))[0] == "missing"


def test_an_effect_that_does_not_pay_for_its_parameters_is_only_possible():
    """Ten seconds are a hundred predictions: 100 log(0.97) = -3.0 does not pay for log(100) = 4.6."""
    candidate = judge(scored(), BASE, refitted(4.0 * np.sqrt(0.97)), SECONDS)
    assert candidate.verdict == "possible"
    assert candidate.bic == pytest.approx(100.0 * np.log(0.97) + np.log(100.0))
    longer = judge(scored(), BASE, refitted(4.0 * np.sqrt(0.97)), 3.0 * SECONDS)
    assert longer.verdict == "missing"
    assert longer.bic < 0.0


def test_a_refit_reports_its_values_and_errors():
    candidate = judge(scored(), BASE, refitted(2.0), SECONDS)
    assert candidate.refitted
    assert candidate.validation_error == 2.0
    assert candidate.heldout_error == 1.7
    assert candidate.parameters["coefficient"].value == 2.0
    assert candidate.parameters["coefficient"].sigma == 0.1
    assert candidate.parameters["coefficient"].unit == "N m s/rad"


def test_without_a_refit_the_linear_step_is_reported():
    candidate = judge(scored(estimate=(1.5,)), BASE, None, SECONDS)
    assert not candidate.refitted
    assert candidate.parameters["coefficient"].value == 1.5
    assert np.isnan(candidate.share)
    assert np.isnan(candidate.bic)


def test_a_score_beyond_chance_without_a_refit_is_possible():
    assert verdict(scored()) == (
        "possible",
        ("its score is beyond chance, but others explain more; it was not refitted",),
    )


def test_a_score_by_chance_is_absent():
    assert verdict(scored(estimate=(0.1,), chance=0.4)) == ("absent", ("it would explain no more than chance",))


def test_a_score_with_the_impossible_sign_is_absent():
    candidate = scored(estimate=(-2.0,), chance=1.0)
    assert candidate.plausible == 0.0
    assert verdict(candidate) == ("absent", ("the data want the impossible sign",))


def test_an_effect_whose_example_would_not_show_is_untestable_and_never_absent():
    effect = catalogue()["motor_viscous"]
    expected = (
        "this motion cannot show it: coefficient of 2 N m s/rad would stay within 3 sigma; needed: "
        + effect.card.excitation
    )
    for estimate in (2.0, -2.0):
        assert verdict(scored(estimate=(estimate,), sigma=(0.7,), chance=1.0)) == ("untestable", (expected,))


def test_one_size_of_two_with_the_impossible_sign_leaves_the_score_of_the_other():
    best = score("bearing_flexibility@joint1", (1e-3, -1e-3), (1e-4, 1e-4))
    value, kept = best.plausible
    assert (value, len(kept)) == (pytest.approx(100.0), 1)


def test_the_share_is_of_the_squared_error_above_the_floor():
    assert excess_share(4.0, 1.0, 1.0) == pytest.approx(1.0)
    assert excess_share(4.0, np.sqrt(8.5), 1.0) == pytest.approx(0.5)
    assert excess_share(4.0, 5.0, 1.0) == pytest.approx(-9.0 / 15.0)
    assert excess_share(4.0, 0.9, 1.0) == 1.0
    assert excess_share(1.0, 0.9, 1.0) == 0.0


def test_a_refit_must_beat_chance_and_the_placebo():
    assert worth_a_refit(scored(), placebo=10.0)
    assert not worth_a_refit(scored(), placebo=1000.0)
    assert not worth_a_refit(scored(chance=0.02), placebo=10.0)


def test_a_refit_that_ran_away_leaves_an_effect_possible():
    found = judge(scored(), BASE, None, SECONDS, failed=True)
    assert (found.verdict, found.reasons) == ("possible", ("its refit ran away; calibrate a robot with it to see",))


def test_one_weak_size_of_two_does_not_make_an_effect_untestable():
    candidate = scored("bearing_flexibility@joint1", (1e-4, 1e-4), (1e-6, 1.0), chance=1.0)
    assert judge(candidate, BASE, None, SECONDS).verdict == "absent"


def test_a_share_that_is_no_number_is_not_printed_as_one():
    assert part_in_words(0.896) == "90 %"
    assert part_in_words(float("nan")) == part_in_words(float("inf")) == "a part that cannot be told"


@pytest.mark.parametrize(("velocity", "verdict"), [(0.004, "stand_in"), (0.1, "missing")])
def test_friction_that_falls_only_where_samples_see_nothing_is_a_stand_in(velocity, verdict):
    sizes = {"torque": EffectEstimate(2.0, 0.1, "N m"), "velocity": EffectEstimate(velocity, 1e-3, "rad/s")}
    candidate = Candidate("motor_stribeck", "joint2", 400.0, 1, 1e-9, sizes, "missing")
    found = standing_in(candidate, {"joint2": 0.016})
    assert found.verdict == verdict
    assert any("holds the joint until it breaks away" in reason for reason in found.reasons) == (verdict == "stand_in")


def test_a_refit_that_was_given_up_says_why_and_is_not_missing():
    reason = "fitted to pieces of the recordings, it misses those between 1.9 times as far as without it"
    assert verdict(scored(), Missed(1.87, converged=True)) == ("absent", (reason,))
    unsure = f"{reason}; its refit did not converge: calibrate a robot with it to see"
    assert verdict(scored(), Missed(1.87, converged=False)) == ("possible", (unsure,))
    assert not judge(scored(), BASE, Missed(1.87, True), SECONDS).refitted
