# SPDX-License-Identifier: BSD-3-Clause
"""Robot file, report and JSON say by their hashes which recordings a result came from, of every kind."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fake_results import fake_calibration, fake_comparison

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.report.page.page import page
from jointscope.tools.report.page.provenance import provenance
from jointscope.tools.verb_parts.result_files import ResultFiles, write_still
from jointscope.tools.writing.origin import KINDS, made_from, recordings_of


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_listed_with_its_name(kind):
    used = {"path": f"{kind}.mcap", "sha256": "ab" * 32}
    assert recordings_of(made_from("arm.yaml") | {kind: [used]}) == [{"kind": kind, **used}]


@pytest.mark.parametrize("kind", ["poses", "rests", "frequency"])
def test_what_is_found_without_motion_says_it_in_robot_file_report_and_json(kind, tmp_path):
    digest = "0123456789abcdef" * 4
    made = made_from("start.yaml") | {kind: [{"path": "still <1>.mcap", "sha256": digest}]}
    files = ResultFiles(tmp_path / "a.html", None, tmp_path / "a.json", tmp_path / "a.yaml")
    write_still(files, load_robot("doggy"), made, lambda more: page("title", "", more), {"verdict": "good"})
    for name in ("a.html", "a.json", "a.yaml"):
        assert digest in (tmp_path / name).read_text(encoding="utf-8"), name
    assert "still &lt;1&gt;.mcap" in (tmp_path / "a.html").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "a.json").read_text())["recordings"][0]["kind"] == kind


def test_rests_beside_motion_stand_in_the_report_too():
    result = fake_calibration(2.0)
    rests = {"rests": [{"path": "weights.mcap", "sha256": "cd" * 32}]}
    body = provenance([bag.recording for bag in result.bags], [result.robot], 1.0, rests).body
    assert "weights.mcap" in body and "cd" * 32 in body
    assert str(Path(result.bags[0].recording.path).name).replace("<", "&lt;").replace(">", "&gt;") in body


def test_a_comparison_says_it_in_its_json():
    result = fake_comparison(2.0)
    used = {"kind": "bags", "path": result.recording.path, "sha256": result.recording.sha256}
    assert result.to_json()["recordings"] == [used]
