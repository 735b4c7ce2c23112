# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import platform
import re
import sys
from pathlib import Path

import measured_page
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def page(tmp_path, monkeypatch):
    page = tmp_path / "measured.md"
    text = "# Measured\n\n<!-- bench a -->\n## A\n\nold\n<!-- end of bench a -->\n\n## Mine\n"
    page.write_text(text, encoding="utf-8")
    monkeypatch.setattr(measured_page, "PAGE", page)
    monkeypatch.setattr(measured_page, "commit", lambda: "1234567")
    monkeypatch.setattr(sys, "argv", ["benchmarks/bench.py", "--json", "x"])
    return page


def test_a_section_takes_the_place_of_what_stood_there(page):
    measured_page.write_section("## A\n\n| 1 |\n", "a")
    text = page.read_text(encoding="utf-8")
    assert "old" not in text and text.count("## A") == 1
    assert re.search(r"## A\n\nMeasured 20\d\d-\d\d-\d\d at commit 1234567 by `python benchmarks/bench.py a` on ", text)
    assert text.index("| 1 |") < text.index("<!-- end of bench a -->") < text.index("## Mine")


def test_a_new_section_goes_to_the_end_and_is_found_again(page):
    for figure in ("first", "second"):
        measured_page.write_section(f"## B\n\n{figure}", "b")
    text = page.read_text(encoding="utf-8")
    assert "first" not in text
    assert text.endswith("second\n<!-- end of bench b -->\n")


def test_the_stamp_names_cores_memory_and_packages_but_no_host():
    told = measured_page.environment()
    assert re.match(r"\d+ cores of \w+, \d+ GiB, ", told)
    assert "gtsam" in told and platform.node() not in told


def test_every_section_of_the_page_says_when_it_was_measured():
    text = (ROOT / "docs" / "measured.md").read_text(encoding="utf-8")
    sections = re.findall(r"<!-- ([\w ]+) -->\n## [^\n]+\n\n(.*?)\n<!-- end of \1 -->", text, re.DOTALL)
    assert len(sections) >= 14
    assert text.count("<!-- end of") == len(sections)
    for name, body in sections:
        assert re.match(r"(Measured \d{4}-\d\d-\d\d at commit \w+|Carried over: )", body), name
        assert (ROOT / "benchmarks" / f"{name.split()[0]}.py").is_file(), name
