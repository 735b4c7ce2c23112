# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis of a recording with one strong hidden effect, and of the same recording once the model has it."""

from __future__ import annotations

import json

import numpy as np
import pytest

CANDIDATE_KEYS = {
    *("effect", "owner", "score", "dof", "p_value", "parameters", "heldout_error", "look_alikes", "verdict"),
}
VERDICTS = {"missing", "possible", "absent", "untestable", "stand_in"}


@pytest.fixture(scope="module")
def lacking(discovered):
    """Diagnosis of the base model."""
    return discovered.result.steps[0].diagnosis


@pytest.fixture(scope="module")
def complete(discovered):
    """Diagnosis of the model with the effect."""
    return discovered.result.steps[-1].diagnosis


def test_the_hidden_effect_is_first_and_missing(lacking, discovered):
    best = lacking.candidates[0]
    assert (best.label, best.verdict) == (discovered.label, "missing")
    assert best.score == max(c.score for c in lacking.candidates)
    assert not lacking.adequate


def test_its_size_is_right_within_ten_percent(lacking, discovered):
    found = lacking.candidates[0].parameters["coefficient"]
    assert found.value == pytest.approx(discovered.coefficient, rel=0.1)
    assert abs(found.value - discovered.coefficient) < 5.0 * found.sigma


def test_nothing_else_is_called_missing(lacking):
    assert [c.label for c in lacking.candidates if c.verdict == "missing"] == [lacking.candidates[0].label]


def test_the_refit_of_the_hidden_effect_leaves_little_on_validation_blocks_and_on_the_held_out_recording(lacking):
    best = lacking.candidates[0]
    assert best.validation_error < 0.2 * lacking.validation_error
    assert best.heldout_error < 0.6 * lacking.error
    assert best.share > 0.9
    assert best.bic < 0.0


def test_nothing_is_accepted_once_the_model_has_the_effect(complete, discovered):
    assert [c.label for c in complete.candidates if c.verdict == "missing"] == []
    assert discovered.label not in [c.label for c in complete.candidates]
    assert complete.adequate
    assert complete.error == pytest.approx(complete.floor, rel=0.1)


def test_scores_of_effects_that_are_not_there_have_the_size_of_chance(complete):
    """A chi-square variable per degree of freedom has a median of 0.5 to 0.8."""
    ratios = [c.score / c.dof for c in complete.candidates]
    assert np.median(ratios) < 3.0
    assert min(c.p_value for c in complete.candidates) > 0.01


def test_the_json_has_the_promised_keys_and_no_nan(lacking):
    content = json.loads(json.dumps(lacking.to_json(), allow_nan=False))
    assert {"adequate", "unexplained_share", "candidates"} <= set(content)
    assert len(content["candidates"]) > 50
    for candidate in content["candidates"]:
        assert set(candidate) >= CANDIDATE_KEYS
        assert candidate["verdict"] in VERDICTS
        assert len(candidate["look_alikes"]) <= 3
        assert all(set(p) == {"value", "sigma", "unit"} for p in candidate["parameters"].values())


def test_the_first_paragraph_names_the_effect_and_the_last_what_cannot_be_tested(lacking, complete, discovered):
    assert lacking.paragraphs[0].startswith("The model lacks ")
    assert f"({discovered.label})" in lacking.paragraphs[0]
    assert complete.paragraphs[0].startswith("The model is adequate: ")
    if any(c.verdict == "untestable" for c in lacking.candidates):
        assert lacking.paragraphs[-1].startswith("Not testable with this motion, which is not the same as absent: ")
