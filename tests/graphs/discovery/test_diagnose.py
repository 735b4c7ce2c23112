# SPDX-License-Identifier: BSD-3-Clause
"""A discovery of one strong hidden effect, and its diagnoses: of the base model, and once the model has the effect."""

from __future__ import annotations

import json
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

CANDIDATE_KEYS = {
    *("effect", "owner", "score", "dof", "p_value", "parameters", "heldout_error", "look_alikes", "verdict"),
}
VERDICTS = {"missing", "possible", "absent", "untestable", "stand_in"}
HIDDEN, COEFFICIENT = "load_dependent_friction@joint2", 0.25


@pytest.fixture(scope="module")
def discovered(doggy):
    """Three seconds of a Doggy whose friction on joint 2 grows with the load, discovered with one refit per round.

    The search starts at the true values of all other parameters, so that calibrations are quick.
    """
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.graphs.discovery import discover, search_kind
    from jointscope.tools.simulator import simulate

    effect = f"{HIDDEN}:coefficient={COEFFICIENT}"
    train = simulate(doggy, "calibration", 3.0, seed=5, friction="smooth", effects=[effect]).recording
    test = simulate(doggy, "moves", 2.0, seed=5, friction="smooth", effects=[effect]).recording
    near = doggy.with_values({name: p.published for name, p in doggy.parameters.items() if p.published is not None})
    saved = []

    def save(number, step):
        saved.append((number, step.label))
        return f"step{number}.yaml"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search_kind, "diagnose", partial(search_kind.diagnose, leaders=1))
        result = discover.discover(near, [train], test, save=save)
    return SimpleNamespace(result=result, saved=saved, label=HIDDEN, coefficient=COEFFICIENT)


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


def test_discover_adds_the_hidden_effect_and_the_held_out_error_falls_to_its_floor(discovered):
    steps = discovered.result.steps
    assert [step.label for step in steps] == ["base model", f"+ {discovered.label}"]
    assert steps[1].train_error < 0.2 * steps[0].train_error
    assert steps[1].heldout_error < 0.6 * steps[0].heldout_error
    assert steps[1].heldout_error == pytest.approx(steps[1].floor, rel=0.1)
    assert discovered.result.adequate
    assert discovered.result.stop_reason == (
        "the model is adequate: no effect of the catalogue is missing, and the error is at its floor"
    )
    assert discovered.result.robot.parameters["joint2.load_dependent_friction.coefficient"].value == pytest.approx(
        discovered.coefficient, rel=0.1
    )


def test_discover_saves_every_step_once(discovered):
    assert discovered.saved == [(0, "base model"), (1, f"+ {discovered.label}")]
    assert discovered.result.robot_file == "step1.yaml"


def test_the_json_of_a_discovery_has_the_promised_keys(discovered):
    content = json.loads(json.dumps(discovered.result.to_json(), allow_nan=False))
    assert set(content) == {"steps", "stop_reason", "adequate", "robot_file"}
    for step in content["steps"]:
        assert {"added", "removed", "train_error", "heldout_error", "floor"} <= set(step)
    assert content["steps"][0]["added"] is None
    assert content["steps"][1]["added"] == discovered.label
