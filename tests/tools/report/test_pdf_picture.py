# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of reports as PDF: what is drawn is where the SVG file has it, in its colours."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
from fake_results import fake_comparison

from jointscope.tools.report import comparison_report
from jointscope.tools.report.page.page import Key
from jointscope.tools.report.page.picture import picture
from jointscope.tools.report.page.report_figures import report_figures
from jointscope.tools.report.page.stacked import stacked
from jointscope.tools.verb_parts.result_files import ResultFiles, write_comparison

pytest.importorskip("matplotlib", reason="comes with the extra plot")
pytest.importorskip("cssselect2", reason="comes with the extra plot")

PLOT = (
    '<svg viewBox="0 0 200 100" role="img"><g transform="translate(20 10)"><text class="y" x="-7" y="40">0.5</text>'
    '<svg class="data" width="160" height="80" viewBox="0 0 1600 800" preserveAspectRatio="none">'
    '<path class="dashed k1" d="M100 200l300 100H800V0"/></svg></g>'
    '<text x="10" y="50" transform="rotate(-90 10 50)">speed</text></svg>'
)


LEGEND = 28.0  # [px] what the legend takes above


@pytest.fixture
def drawn(monkeypatch):
    """The axes of a picture before they become a file."""
    from jointscope.tools.report.pdf import pdf_picture as module

    kept = []
    monkeypatch.setattr(module.Figure, "savefig", lambda figure, page, **_: kept.append(figure.axes[0]))
    module.pdf_picture(picture(stacked([PLOT], [Key("one <b>", "k2")])))
    return kept[0]


def on_page(artist, axes):
    """Points of a path in pixels of the picture."""
    return (artist.get_transform() - axes.transData).transform(artist.get_path().vertices)


def test_a_curve_lies_where_the_svg_has_it(drawn):
    (curve,) = [patch for patch in drawn.patches if patch.get_linestyle() not in ("solid", "-")]
    expected = np.array([(10.0, 20.0), (40.0, 30.0), (80.0, 30.0), (80.0, 0.0)]) + np.array((20.0, LEGEND + 10.0))
    np.testing.assert_allclose(on_page(curve, drawn), expected, atol=1e-9)
    assert curve.get_clip_path() is not None


def test_it_has_the_colour_of_its_class_and_the_width_of_the_style_sheet(drawn):
    (curve,) = [patch for patch in drawn.patches if patch.get_linestyle() not in ("solid", "-")]
    np.testing.assert_allclose(curve.get_edgecolor(), (0, 0x91 / 255, 0x6A / 255, 1.0))
    assert curve.get_facecolor()[3] == 0.0
    assert curve.get_linewidth() == pytest.approx(1.5 * 0.75)


def test_words_stand_at_their_places_turned_as_in_the_svg(drawn):
    words = {text.get_text(): text for text in drawn.texts}
    assert set(words) == {"0.5", "speed", "one <b>"}
    assert words["0.5"].get_position() == pytest.approx((13.0, LEGEND + 50.0))
    assert words["0.5"].get_ha() == "right"
    assert words["speed"].get_position() == pytest.approx((10.0, LEGEND + 50.0))
    assert words["speed"].get_rotation() == pytest.approx(90.0)


def test_every_picture_of_a_report_becomes_a_page_and_the_same_again():
    from jointscope.tools.report.pdf.pdf_picture import pdf_picture

    pictures = report_figures(comparison_report(fake_comparison(2.0)))
    pages = {name: pdf_picture(svg) for name, svg in pictures.items()}
    assert all(page.startswith(b"%PDF-") for page in pages.values())
    first = next(iter(pictures))
    assert pdf_picture(pictures[first]) == pages[first]


def test_a_curve_that_no_report_draws_is_refused():
    from jointscope.tools.report.pdf.pdf_picture import path_of

    with pytest.raises(ValueError, match=r"^path with 'C': expected one of M, L, H, V, Z$"):
        path_of("M0 0C1 1 2 2 3 3")


def test_variables_of_the_style_sheet_follow_the_parents():
    from jointscope.tools.report.pdf.styles import styled, value

    own = "path { stroke: var(--c); fill: var(--no, red); }"
    sheet = f":root {{ --ink: light-dark(#111, #eee); }} .a {{ --c: var(--ink); }} {own}"
    svg = f'<svg xmlns="http://www.w3.org/2000/svg"><style>{sheet}</style><g class="a"><path d=""/></g></svg>'
    *_, (path, style) = styled(ElementTree.fromstring(svg))
    assert path.local_name == "path"
    assert (value(style, "stroke"), value(style, "fill")) == ("#111", "red")


def test_a_verb_writes_both_kinds_and_without_the_extra_says_how_to_get_it(tmp_path, monkeypatch, capsys):
    files = ResultFiles(figures=tmp_path)
    write_comparison(fake_comparison(2.0), files)
    names = {suffix: {path.stem for path in tmp_path.glob(f"*{suffix}")} for suffix in (".svg", ".pdf")}
    assert names[".svg"] == names[".pdf"] != set()
    files.tell()
    assert "pip install" not in capsys.readouterr().out
    monkeypatch.setattr("jointscope.tools.verb_parts.result_files.find_spec", lambda _: None)
    files.tell()
    assert capsys.readouterr().out.endswith("\nPictures as PDF, too: pip install 'jointscope[plot]'\n")
