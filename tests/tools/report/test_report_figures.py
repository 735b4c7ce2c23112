# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of a report as files: all of them, with their legends, each well-formed and of a finite size."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from fake_diagnosis import fake_diagnosis, fake_discovery
from fake_results import fake_calibration, fake_comparison

from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.report import calibration_report, comparison_report, diagnosis_report, discovery_report
from jointscope.tools.report.page.page import Key
from jointscope.tools.report.page.report_figures import report_figures
from jointscope.tools.report.page.stacked import stacked
from jointscope.tools.report.sections.calibration.states import states
from jointscope.tools.report.story_picture import story_picture
from jointscope.tools.verb_parts.result_files import ResultFiles, write_comparison

SVG = "{http://www.w3.org/2000/svg}"
REPORTS = {
    "calibration": lambda: calibration_report(fake_calibration(2.0)),
    "comparison": lambda: comparison_report(fake_comparison(2.0)),
    "diagnosis": lambda: diagnosis_report(fake_diagnosis()),
    "discovery": lambda: discovery_report(fake_discovery()),
}


@pytest.fixture(scope="module", params=list(REPORTS))
def html(request):
    return REPORTS[request.param]()


def test_every_picture_of_a_report_is_a_file(html):
    found = report_figures(html)
    assert len(found) >= 4
    pictures = len(re.findall(r'<svg\b[^>]*role="img"', html))
    assert sum(svg.count('role="img"') - 1 for svg in found.values()) == pictures  # each file is one around them
    anchors = set(re.findall(r'<section id="([^"]+)"', html))
    assert {re.sub(r"(-\d+)?\.svg$", "", name) for name in found} <= anchors


def test_every_file_is_an_svg_of_its_own_with_what_it_shows_inside_of_it(html):
    for name, svg in report_figures(html).items():
        root = ElementTree.fromstring(svg)
        assert root.tag == f"{SVG}svg", name
        *_, width, height = map(float, root.attrib["viewBox"].split())
        for inner in root.findall(f"{SVG}svg"):
            assert float(inner.attrib["x"]) + float(inner.attrib["width"]) <= width, name
            assert float(inner.attrib["y"]) + float(inner.attrib["height"]) <= height, name


def test_a_legend_comes_along():
    (svg,) = (svg for name, svg in report_figures(REPORTS["comparison"]()).items() if name == "horizons.svg")
    text = "".join(ElementTree.fromstring(svg).itertext())
    assert "doggy_calibrated <b>.yaml" in text


def test_pictures_stand_beside_each_other_while_there_is_room():
    small = '<svg viewBox="0 0 360 100" role="img"></svg>'
    places = re.findall(r'<svg x="(\d+)" y="(\d+)"', stacked([small] * 4))
    assert places == [("0", "0"), ("368", "0"), ("736", "0"), ("0", "108")]
    with_legend = stacked([small], [Key("measured", "soft", "wide")], "title")
    assert re.findall(r'<svg x="(\d+)" y="(\d+)"', with_legend) == [("0", "48")]


def test_a_verb_makes_the_folder_and_writes_into_one_that_is_there(tmp_path):
    for _ in range(2):
        write_comparison(fake_comparison(2.0), ResultFiles(figures=tmp_path / "pictures"))
    assert {path.suffix for path in (tmp_path / "pictures").iterdir()} - {".pdf"} == {".svg"}


def test_a_folder_that_cannot_be_is_told_before_the_work(tmp_path):
    Path(tmp_path / "file").write_text("")
    with pytest.raises(JointscopeError, match=r"^cannot write into .*file: it is a file; expected a folder$"):
        ResultFiles(figures=tmp_path / "file")
    with pytest.raises(JointscopeError, match=r"the folder .*no does not exist; create it first$"):
        ResultFiles(figures=tmp_path / "no" / "pictures")


def test_a_legend_shows_a_dot_for_dots_and_an_area_for_a_band():
    keys = [Key("measured", "k0", "dots"), Key("model", "k1"), Key("two sigmas", "k1", "band")]
    root = ElementTree.fromstring(stacked(['<svg viewBox="0 0 100 50"></svg>'], keys))
    shapes = [path.attrib["d"] for path in root.iter("path")]
    assert re.fullmatch(r"M[\d.]+ [\d.]+h0", shapes[0])
    assert re.fullmatch(r"M[\d.]+ [\d.]+h[1-9]\d*", shapes[1])
    assert shapes[2].endswith("z")


def test_the_picture_of_a_story_says_what_it_shows_to_those_who_hear_it():
    outer = ElementTree.fromstring(story_picture(fake_discovery()))
    assert "step by step" in outer.attrib["aria-label"]
    kept = ElementTree.parse(Path(__file__).parents[3] / "docs" / "pictures" / "story.svg").getroot()
    assert kept.attrib["aria-label"] == outer.attrib["aria-label"]


@pytest.mark.parametrize(
    ("robot", "said"), (("doggy", "No encoder sees the links"), ("biorob", "Encoders see the links"))
)
def test_what_sees_the_links_is_said_of_the_states(robot, said):
    result = dataclasses.replace(fake_calibration(0.2), robot=load_robot(robot), bags=())
    assert said in states(result).lead
