# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from fake_diagnosis import BEARING, fake_candidates, fake_diagnosis
from result_page import ResultPage

from jointscope.graphs.comparison.failure_analysis import FailureAnalysis
from jointscope.tools.presentation.model_answer import diagnosis_answer, enumerated
from jointscope.tools.report import diagnosis_report
from jointscope.tools.report.sections.diagnosis.torque_over_time import torque_spectrum
from jointscope.tools.rerun_log.entities.diagnosis_documents import diagnosis_markdown, ranking_markdown
from jointscope.tools.terminal.diagnosis_text import diagnosis_text

SECTIONS = (
    "verdict ranking channels regimes correlations horizons worst maps torque levels untestable next notices provenance"
)


@pytest.fixture(scope="module")
def found():
    return fake_diagnosis()


@pytest.fixture(scope="module")
def page(found):
    return ResultPage(diagnosis_report(found))


def test_every_section_is_there_in_order_and_holds_only_numbers(page):
    assert [i for i in page.ids if i != "theme"] == SECTIONS.split()
    page.check()


def test_the_answer_names_the_effect_and_its_numbers(page):
    assert "The model is not adequate: it lacks bearing_flexibility@joint1." in page.text
    told = "The error 0.1 s ahead on the held-out recording is 13.2 sensor sigmas, noise alone would give 1.20; 99 %"
    assert told in page.text


def test_the_ranking_shows_sizes_with_sigmas_units_verdicts_and_reasons(page):
    for part in (
        "compliance_x = 0.0004020 ± 0.0000061 rad/(N m)",
        "looks like gyro_scale@imu1",
        "stiffness_x = 2488 ± 38 N m/rad",
        "Its sign is not physical.",
        "12.9 held out",
        "ΔBIC −420000",
        "numerics, not physics",
        "untestable",
        "a score of 14.0 per degree of freedom",
    ):
        assert part in page.text, part


def test_commands_to_run_next_are_quoted_for_the_shell(page):
    assert f"jointscope add doggy {BEARING} -o doggy_bearing_flexibility.yaml" in page.text
    assert (
        "jointscope calibrate doggy_bearing_flexibility.yaml 'runs/train <1>.mcap' -o doggy_calibrated.yaml"
        in page.text
    )
    assert "--holdout runs/test.mcap -o doggy_better.yaml" in page.text


def test_an_untestable_effect_comes_with_the_motion_that_would_show_it(page):
    from jointscope.robots.files.effect_catalogue import catalogue

    assert catalogue()["gravity_imbalance"].card.excitation.split(".")[0][1:] in page.text


def test_an_adequate_model_is_called_adequate_and_has_nothing_to_add():
    page = ResultPage(diagnosis_report(fake_diagnosis(found=False, held_out=False)))
    page.check()
    assert "The model is adequate: no physical effect is missing." in page.text
    assert "jointscope add" not in page.text
    assert "on the training recording, which the model was fitted to, is 1.23 sensor sigmas" in page.text
    assert "the base model, which was fitted to them, too, has 1.26 σ" in page.text


def test_what_is_unexplained_is_that_of_the_error_beside_it(found):
    after_the_refit = dataclasses.replace(found, unexplained_share=0.02)
    assert "; 99 % of the squared error is unexplained." in diagnosis_answer(after_the_refit).why
    assert (
        "first training recording"
        in diagnosis_answer(dataclasses.replace(found, heldout=None, recordings=found.recordings * 2)).why
    )


def test_a_bare_diagnosis_is_reported(found):
    bare = dataclasses.replace(
        found, candidates=(), missing=None, comparison=None, noise_levels={}, paragraphs=(), recordings=(),
        heldout=None, failure=FailureAnalysis({}, {}, ()), wall_seconds={}, placebo_score=float("nan"),
    )  # fmt: skip
    page = ResultPage(diagnosis_report(bare))
    page.check()
    for part in ("No effect of the catalogue can act on this robot.", "The missing torque was not estimated."):
        assert part in page.text
    assert "no known effect explains what is missing" in diagnosis_text(bare)


def test_values_that_are_missing_leave_holes_not_nan(found):
    nan = float("nan")
    odd = [
        dataclasses.replace(c, p_value=nan, share=nan, validation_error=nan, bic=nan,
                            parameters={n: dataclasses.replace(p, sigma=nan) for n, p in c.parameters.items()})
        for c in found.candidates
    ]  # fmt: skip
    failure = dataclasses.replace(
        found.failure,
        channels={
            n: dataclasses.replace(
                c, autocorrelation=nan, whiteness_p=nan, correlations={"joint1.load": nan}, regimes={}
            )
            for n, c in found.failure.channels.items()
        },
    )
    broken = dataclasses.replace(found, candidates=tuple(odd), failure=failure)
    ResultPage(diagnosis_report(broken)).check()
    assert "nan" not in diagnosis_text(broken)


def test_names_are_escaped(found):
    candidate = dataclasses.replace(found.candidates[0], reasons=("a < b & c",), effect="<b>mine")
    html = diagnosis_report(dataclasses.replace(found, candidates=(candidate,), paragraphs=("x <i> y",)))
    assert "<b>mine" not in html and "&lt;b&gt;mine" in html
    assert "A &lt; b &amp; c" in html and "X &lt;i&gt; y" in html


def test_an_hour_long_catalogue_folds_and_a_long_recording_stays_small():
    found = fake_diagnosis(30.0)
    many = dataclasses.replace(found, candidates=fake_candidates() * 6)
    html = diagnosis_report(many)
    assert len(html.encode()) < 3e6
    assert "more candidates</summary>" in html


@pytest.mark.parametrize(
    ("verdicts", "headline"),
    [
        (("possible", "absent"), "; it may lack bearing_flexibility@joint1, but no effect is certain."),
        (("missing", "missing"), ": it lacks bearing_flexibility@joint1 and gyro_scale@imu1."),
        (("absent", "absent"), ", and no known effect explains what is missing."),
    ],
)
def test_the_headline_follows_from_the_verdicts(found, verdicts, headline):
    pairs = zip(found.candidates, verdicts, strict=False)
    candidates = tuple(dataclasses.replace(c, verdict=verdict) for c, verdict in pairs)
    assert (
        diagnosis_answer(dataclasses.replace(found, candidates=candidates)).headline
        == f"The model is not adequate{headline}"
    )


def test_a_defect_of_the_computation_is_no_missing_physics(found):
    numerics = dataclasses.replace(found.candidates[-1], verdict="missing")
    answer = diagnosis_answer(dataclasses.replace(found, candidates=(numerics,), adequate=True))
    assert answer.headline == "The model is adequate: no physical effect is missing."


def test_a_missing_defect_of_the_computation_without_sizes_leaves_no_holes(found):
    numerics = dataclasses.replace(
        found.candidates[-1], verdict="missing", share=0.97, refitted=True, validation_error=1.3, bic=-900.0
    )
    result = dataclasses.replace(found, candidates=(numerics, *found.candidates[1:]))
    headline = "The model is not adequate: its computation is too coarse (integration_error@robot)."
    page, text, markdown = ResultPage(diagnosis_report(result)), diagnosis_text(result), ranking_markdown(result)
    page.check()
    for told in (page.text, text, diagnosis_markdown(result)):
        assert headline in told
    assert "ΔBIC −900" in page.text and "refit, ΔBIC −900" not in page.text
    assert "jointscope add doggy integration_error@robot" in page.text
    assert "Next: jointscope add doggy integration_error@robot" in text
    assert "| **missing** (numerics) | 61.0 | 1 | 0.020 | 97 % | 1.30 | — | — |" in markdown
    sizes = text.split("Sizes:")[1].split("\n\n")[0]
    assert "integration_error" not in sizes and "gyro_scale@imu1" in sizes
    for told in (text, markdown, page.text):
        assert "()" not in told and "nan" not in told.split() and "None" not in told


def test_the_screen_shows_ranking_sizes_and_what_to_do():
    text = diagnosis_text(fake_diagnosis())
    assert text.splitlines()[0] == "The model is not adequate: it lacks bearing_flexibility@joint1."
    for line in (
        "  1  bearing_flexibility@joint1  missing            3.10·10⁶    2  1.0·10⁻¹²      98 %        1.24      1.23  "
        "gyro_scale@imu1",
        "  7  integration_error@robot     absent (numerics)      61.0    1      0.020         —           —         —",
        "  bearing_flexibility@joint1  compliance_x  0.0004020  0.0000061  rad/(N m)  refit",
        "Not testable with these recordings, so neither missing nor absent: gravity_imbalance@joint2",
        "Next: jointscope add doggy bearing_flexibility@joint1 -o doggy_bearing_flexibility.yaml (it explains 98 % of "
        "the excess error)",
    ):
        assert line in text.splitlines(), line
    assert max(map(len, text.splitlines())) < 190


def test_lists_read_well():
    assert [enumerated(names) for names in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == [
        "",
        "a",
        "a and b",
        "a, b and c",
    ]


def test_the_spectrum_finds_a_frequency_and_its_size():
    t = np.arange(8000) * 1e-3
    torque = np.column_stack([np.sin(2 * np.pi * 20.0 * t), 0.01 * np.random.default_rng(0).normal(size=len(t))])
    f, density = torque_spectrum(t, torque)
    assert f[np.argmax(density[:, 0])] == pytest.approx(20.0, abs=1.0)
    # white noise of standard deviation s sampled at rate r has the density s sqrt(2 / r)
    assert np.median(density[:, 1]) == pytest.approx(0.01 * np.sqrt(2 / 1000.0), rel=0.2)
    assert torque_spectrum(t[:5], torque[:5])[1].shape == (0, 2)
