# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import dataclasses
import re
import runpy
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.recordings.recording import Recording
from jointscope.tools.presentation.numbers import prefixed, significant, with_sigma
from jointscope.tools.report import calibration_report, comparison_report
from jointscope.tools.report.page.page import sentence
from jointscope.tools.report.page.plot import Axes, Band, Bars, Curve, min_max, path, plot
from jointscope.tools.report.page.scale import log_ticks, nice_ticks
from jointscope.tools.report.sections.comparison.predictions import joined
from jointscope.tools.terminal.calibration_text import calibration_text
from jointscope.tools.verdicts.judgement import judge

FAKES = runpy.run_path(str(Path(__file__).with_name("fake_results.py")))
VOID = {"meta", "br", "link", "img", "input", "hr"}
CALIBRATION_SECTIONS = (
    "verdict parameters mounting fits commands residuals weak correlation noise states convergence notices provenance"
)
COMPARISON_SECTIONS = "scores horizons predictions worst channels notices provenance"


class Page(HTMLParser):
    """Collects what the tests ask about and checks that tags nest."""

    def __init__(self, html):
        super().__init__()
        self.open, self.ids, self.links, self.numbers, self.text = [], [], [], [], []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        values = dict(attributes)
        self.ids += [values["id"]] if "id" in values else []
        self.links += [values[key] for key in ("href", "src", "action", "xlink:href") if key in values]
        self.numbers += [values[k] for k in ("d", "x", "y", "width", "height", "viewbox", "transform") if k in values]

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def result():
    return FAKES["fake_calibration"](2.0)


@pytest.fixture(scope="module")
def calibration_html(result):
    return calibration_report(result)


@pytest.fixture(scope="module")
def comparison_html():
    return comparison_report(FAKES["fake_comparison"](2.0))


@pytest.fixture(params=["calibration_html", "comparison_html"])
def html(request):
    return request.getfixturevalue(request.param)


def test_every_section_of_the_calibration_is_there_in_order(calibration_html):
    assert [i for i in Page(calibration_html).ids if i != "theme"] == CALIBRATION_SECTIONS.split()


def test_every_section_of_the_comparison_is_there_in_order(comparison_html):
    assert [i for i in Page(comparison_html).ids if i != "theme"] == COMPARISON_SECTIONS.split()


def test_the_page_asks_the_network_for_nothing(html):
    assert all(link.startswith("#") for link in Page(html).links)
    for forbidden in ("http://", "https://", "@import", "url(", "fetch(", "XMLHttpRequest"):
        assert forbidden not in html


def test_the_pictures_hold_only_numbers(html):
    for number in Page(html).numbers:
        assert not re.search(r"nan|inf", number, re.IGNORECASE), number


def test_names_are_escaped(calibration_html, comparison_html):
    assert "train <1>" not in calibration_html
    assert "runs/train &lt;1&gt;.mcap" in calibration_html
    assert "rigid &amp; is held" in calibration_html
    assert "<b>.yaml" not in comparison_html
    assert "doggy_calibrated &lt;b&gt;.yaml" in comparison_html


def test_values_sigmas_and_table_1_are_printed(calibration_html):
    text = " ".join(Page(calibration_html).text)
    assert "187.56" in text and "0.38" in text  # joint1.stiffness, sigma 0.2 %
    assert "Table 1" in text
    assert "not observable here; held by its prior" in text


def test_65_seconds_at_1_khz_stay_below_3_megabytes():
    html = calibration_report(FAKES["fake_calibration"](65.0))
    assert len(html.encode()) < 3e6


def test_several_recordings_fold_and_stay_small():
    html = calibration_report(FAKES["fake_calibration"](2.0, bags=3))
    assert html.count("<summary>recording train 3.mcap</summary>") == 5
    assert len(html.encode()) < 3e6


def test_a_recording_without_events_and_a_calibration_without_history_are_reported(result):
    recording = result.bags[0].recording
    quiet = Recording(recording.path, recording.sha256, recording.start_ns, recording.streams)
    bags = (dataclasses.replace(result.bags[0], recording=quiet),)
    bare = dataclasses.replace(
        result, bags=bags, iterations=(), findings=(), weak_directions=(), sigma_inflation={}, cost=0.0
    )
    text = " ".join(Page(calibration_report(bare)).text)
    assert "every sample was used as it came" in text
    assert "The solver kept no history" in text
    assert "every combination is well determined" in text


def test_values_that_are_missing_leave_holes_not_nan(result):
    bag = result.bags[0]
    residuals = {name: dataclasses.replace(s, predicted=s.predicted.copy()) for name, s in bag.residuals.items()}
    for series in residuals.values():
        series.predicted[100:300] = np.nan
    broken = dataclasses.replace(result, bags=(dataclasses.replace(bag, residuals=residuals),))
    assert not any(re.search("nan", n, re.IGNORECASE) for n in Page(calibration_report(broken)).numbers)


def test_a_good_calibration_is_called_good_although_the_yaw_is_held(result):
    certain = tuple(
        p if ".R_imu" in p.name or ".bias" in p.name else dataclasses.replace(p, sigma=1e-3 * p.value)
        for p in result.parameters
    )
    assert judge(dataclasses.replace(result, parameters=certain)).level == "good"


def test_a_channel_far_off_its_noise_makes_the_calibration_bad(result):
    channels = dict(result.channels)
    channels["imu1.x"] = dataclasses.replace(channels["imu1.x"], chi2=9.0)
    judgement = judge(dataclasses.replace(result, channels=channels))
    assert judgement.level == "bad"
    assert "imu1.x" in judgement.checks[0].text and "9.00" in judgement.checks[0].text


def test_a_residual_with_memory_is_named(result):
    bag = result.bags[0]
    series = bag.residuals["imu2"]
    wave = series.predicted + 3.0 * series.sigma * np.sin(20.0 * series.times)[:, None]
    residuals = {**bag.residuals, "imu2": dataclasses.replace(series, predicted=wave)}
    judgement = judge(dataclasses.replace(result, bags=(dataclasses.replace(bag, residuals=residuals),)))
    assert judgement.level == "bad"
    assert "in imu2." in judgement.checks[1].text


def test_a_burst_in_the_dynamics_is_found_at_its_time(result):
    bag = result.bags[0]
    process = bag.process.copy()
    process[1500:1550, 1] *= 40.0
    judgement = judge(dataclasses.replace(result, bags=(dataclasses.replace(bag, process=process),)))
    assert judgement.checks[2].level in ("warn", "bad")
    assert "joint2 link equation, around 1.5 s" in judgement.checks[2].text


def test_two_digits_of_sigma_decide_the_rounding():
    assert with_sigma(187.5552, 0.0996) == ("187.56", "0.10")
    assert with_sigma(187.5552, 0.0234) == ("187.555", "0.023")
    assert with_sigma(-0.04404, 1.2e-5) == ("−0.044040", "0.000012")
    assert with_sigma(1234.0, 56.0) == ("1234", "56")
    assert with_sigma(3.2e-9, 1.4e-10) == ("3.20·10⁻⁹", "0.14·10⁻⁹")
    assert with_sigma(2.0, float("nan")) == ("2.0000", "—")


def test_numbers_read_well():
    assert [significant(x) for x in (0.0, 1.0, -0.01234, 3.3e6, 9.996)] == ["0", "1.00", "−0.0123", "3.30·10⁶", "10.0"]
    assert prefixed(6.9e-5, "rad") == (1e6, "µrad")
    assert sentence("worst is +-3 %") == "Worst is ±3 %."
    assert sentence("joint1.stiffness is weak.") == "joint1.stiffness is weak."


def test_ticks_are_1_2_5():
    assert [label for _, label in nice_ticks(-0.9, 1.1, 4)] == ["−0.5", "0.0", "0.5", "1.0"]
    assert [label for _, label in nice_ticks(32.5, 34.5, 5)] == ["32.5", "33.0", "33.5", "34.0", "34.5"]
    assert [label for _, label in log_ticks(0.005, 3e4)] == ["0.01", "0.1", "1", "10", "100", "1000", "10⁴"]


def test_decimation_keeps_every_extreme_and_every_hole():
    x = np.arange(65_000.0)
    y = np.random.default_rng(1).normal(size=len(x))
    y[12_345], y[50_000], y[30_000:30_100] = 40.0, -50.0, np.nan
    kept_x, kept_y = min_max(x, y)
    assert len(kept_x) < 1700
    assert np.nanmax(kept_y) == 40.0 and np.nanmin(kept_y) == -50.0
    assert np.isnan(kept_y[(kept_x >= 29_900) & (kept_x <= 30_200)]).any()
    assert np.all(np.diff(kept_x) > 0)


def test_sparse_predictions_are_joined_but_not_across_long_gaps():
    t = np.arange(1000) * 1e-3
    y = np.full(1000, np.nan)
    y[::10] = 1.0
    y[400:600] = np.nan
    times, values = joined(t, y)
    assert np.isnan(values).sum() == 1
    assert 0.39 < times[np.isnan(values)][0] < 0.6


def test_a_path_is_relative_and_lifts_the_pen_at_holes():
    x, y = np.arange(5.0), np.array([0.0, 1.0, np.nan, 3.0, 2.0])
    assert path(x, y) == "M0 0l10 10M30 30l10-10"
    assert path(x, np.full(5, np.nan)) == ""


def test_a_plot_survives_empty_constant_and_diverging_curves():
    t = np.linspace(0.0, 1.0, 50)
    marks = [
        Curve("empty", t[:0], t[:0]),
        Curve("constant", t, np.ones(50)),
        Curve("diverging", t, np.where(t > 0.5, np.inf, 1.0)),
        Band("band", t, np.zeros(50), np.ones(50)),
        Bars("bars", t, np.ones(49)),
    ]
    svg = plot(Axes("all <sorts>", y_range=(0.0, 2.0)), marks)
    assert "nan" not in svg and "inf" not in svg.replace("all &lt;sorts&gt;", "")
    assert "all &lt;sorts&gt;" in svg


def test_a_calibration_with_a_bearing_and_a_memory_is_reported_by_joint_and_by_hinge():
    result = FAKES["fake_calibration_with_effects"]()
    text = calibration_text(result)
    page = Page(calibration_report(result))
    assert [i for i in page.ids if i != "theme"] == CALIBRATION_SECTIONS.split()
    assert "imu2.z" in text
    assert "joint1.bearing_x link" in " ".join(page.text)
    assert not any(re.search("nan", number, re.IGNORECASE) for number in page.numbers)
