# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses

import pytest
from fake_diagnosis import BEARING, fake_diagnosis, fake_discovery
from result_page import ResultPage
from test_rerun_log import paths, scalars, tab_names

from jointscope.tools.presentation.model_answer import changes, discovery_answer
from jointscope.tools.report import discovery_report
from jointscope.tools.rerun_log import log_diagnosis, log_discovery
from jointscope.tools.terminal.discovery_text import discovery_text

SECTIONS = (
    "verdict waterfall found worst horizons ranking channels regimes correlations maps torque levels untestable later "
    "next notices provenance"
)


@pytest.fixture(scope="module")
def result():
    return fake_discovery()


@pytest.fixture(scope="module")
def page(result):
    return ResultPage(discovery_report(result))


def unfinished(result, label=BEARING):
    """The effect was added, the model is still not adequate."""
    steps = (result.steps[0], dataclasses.replace(result.steps[1], added=label, heldout_error=4.2))
    return dataclasses.replace(result, steps=steps, adequate=False, stop_reason="No candidate lowers the error.")


def test_every_section_is_there_in_order_and_holds_only_numbers(page):
    assert [i for i in page.ids if i != "theme"] == SECTIONS.split()
    page.check()


def test_the_waterfall_shows_both_errors_and_the_floor_of_every_step(page):
    for part in ("0: base model", f"1: + {BEARING}", "12.3 σ", "13.2 σ", "1.24 σ", "1.23 σ", "13.2 → 1.23"):
        assert part in page.text, part


def test_effects_are_told_with_sigma_and_the_stiffness_beside_its_compliance(result, page):
    for part in ("joint1.bearing_flexibility.compliance_x 0.0004020 0.0000060 rad/(N m)", "2488 37 N m/rad"):
        assert part in page.text, part
    lines = discovery_text(result).splitlines()
    assert "  joint1.bearing_flexibility.stiffness_x        2488         37  N m/rad" in lines


def test_before_and_after_stand_in_one_picture(page):
    assert 'data-name="base model"' in page.html and 'data-name="last model"' in page.html


def test_without_a_held_out_recording_the_training_error_judges_and_is_called_so():
    result = fake_discovery(held_out=False)
    page = ResultPage(discovery_report(result))
    page.check()
    told = "The error on the training recordings, which the model is fitted to, went from 12.3 to 1.24 sensor sigmas"
    assert told in page.text
    assert "error 0.1 s ahead on the training recordings" in page.text
    assert "left out" not in discovery_text(result)
    assert "held-out recording</button>" not in page.html
    assert result.to_json()["steps"][0]["heldout_error"] is None
    assert "nan" not in discovery_text(result)


def test_a_single_step_that_was_adequate_at_once(result):
    alone = dataclasses.replace(result, steps=result.steps[:1], adequate=True)
    page = ResultPage(discovery_report(alone))
    page.check()
    assert "The model is adequate as it was." in page.text
    assert "No effect was added." in page.text


def test_steps_of_an_earlier_run_have_no_diagnosis(result):
    steps = tuple(dataclasses.replace(step, diagnosis=None) for step in result.steps)
    page = ResultPage(discovery_report(dataclasses.replace(result, steps=steps, recordings=(), heldout=None)))
    page.check()
    assert "ranking" not in page.ids


@pytest.mark.parametrize(
    ("effects", "headline"),
    [
        ((None, BEARING), "The model is better with bearing_flexibility@joint1, but still not adequate."),
        ((None, None), "The model is not adequate, and no known effect makes it better."),
    ],
)
def test_the_headline_says_what_is_not_reached(result, effects, headline):
    assert discovery_answer(unfinished(result, effects[1])).headline == headline


def test_effects_that_explain_only_part_may_stand_in_for_something_else(result):
    base, step = result.steps
    half = dataclasses.replace(step, heldout_error=8.0, train_error=8.0)  # of 13.2; the floor is 1.21
    stuck = dataclasses.replace(result, steps=(base, half), adequate=False)
    assert "What changed explains 64 % of the squared error" in discovery_answer(stuck).why
    assert "stand in" in discovery_text(stuck)
    nearly = dataclasses.replace(result, steps=(base, dataclasses.replace(half, heldout_error=3.0)), adequate=False)
    assert "stand in" not in discovery_answer(nearly).why
    assert "stand in" not in discovery_answer(result).why


def test_an_effect_that_was_taken_out_again_is_no_change(result):
    base, step = result.steps
    out = dataclasses.replace(step, added="cogging@joint1", removed=BEARING)
    assert changes(dataclasses.replace(result, steps=(base, step, out))) == ["cogging@joint1"]
    assert changes(dataclasses.replace(result, steps=(base, out))) == ["cogging@joint1", f"without {BEARING}"]


def test_a_better_integrator_is_told_as_a_defect_that_went(result):
    base, step = result.steps
    better = dataclasses.replace(step, added="integration_error@robot", robot=base.robot)
    found = dataclasses.replace(result, steps=(base, better))
    page = ResultPage(discovery_report(found))
    page.check()
    assert "The model is adequate without integration_error@robot." in page.text
    assert "integration_error@robot: without a size." in page.text
    assert "jointscope remove" not in page.text  # the robot file names an integrator, not an effect
    assert "The model is adequate without integration_error@robot." in discovery_text(found)


def test_the_screen_shows_the_waterfall_and_why_it_stopped(result):
    lines = discovery_text(result).splitlines()
    for line in (
        "The model is adequate with bearing_flexibility@joint1.",
        "The error on the held-out recording went from 13.2 to 1.23 sensor sigmas; noise alone would give 1.21.",
        "     0  base model                        12.3      13.2   1.20         99 %",
        "     1  + bearing_flexibility@joint1      1.24      1.23   1.21        3.2 %",
        "Stopped: The model is adequate.",
    ):
        assert line in lines, line
    assert "Ranking of what may be missing" in discovery_text(unfinished(result))


def test_the_viewers_file_of_a_discovery_tells_the_same_story(result, tmp_path):
    log_discovery(result, tmp_path / "run.rrd")
    found = paths(tmp_path / "run.rrd")
    for path in (
        "/waterfall/text",
        "/waterfall/bars/heldout_error",
        "/step0/ranking",
        "/step0/torque/joint2.link/explained",
        "/step0/maps/1/lines",
        "/step1/findings",
        "/ahead/imu1.x/predicted",
    ):
        assert path in found, path
    assert {"waterfall", "step 0: base model", f"step 1: + {BEARING}", "0.1 s ahead"} <= tab_names(tmp_path / "run.rrd")


def test_the_missing_torque_comes_back_as_it_was(tmp_path):
    diagnosis = fake_diagnosis(1.0)
    log_diagnosis(diagnosis, tmp_path / "run.rrd")
    assert {"/findings", "/ranking", "/maps/1/limits"} <= paths(tmp_path / "run.rrd")
    torque = scalars(tmp_path / "run.rrd", "/torque/joint3.link/missing").ravel()
    assert torque.tolist() == diagnosis.missing.torque[:, 2].tolist()
    band = scalars(tmp_path / "run.rrd", "/torque/joint3.link/band")
    assert band[0, 1] == pytest.approx(3.0 * diagnosis.missing.sigma[0, 2])


def test_a_diagnosis_without_torque_and_comparison_is_logged(tmp_path):
    log_diagnosis(dataclasses.replace(fake_diagnosis(0.5), missing=None, comparison=None), tmp_path / "run.rrd")
    assert paths(tmp_path / "run.rrd") >= {"/findings", "/ranking"}
