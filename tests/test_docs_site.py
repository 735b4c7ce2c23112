# SPDX-License-Identifier: BSD-3-Clause
"""The pages become a site without a warning: links lead somewhere, every page is in its list, nothing is fetched."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[1]
LOADED = re.compile(r"<(?:script|img|iframe)[^>]*\ssrc=\"(https?:|//)[^\"]*\"|<link[^>]*\shref=\"(https?:|//)[^\"]*\"")


@pytest.mark.slow
def test_the_site_is_built_from_every_page_and_asks_nothing_of_the_internet(tmp_path):
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet"]
    ran = subprocess.run([*command, ROOT / "docs", tmp_path / "site"], capture_output=True, text=True, timeout=600)
    assert ran.returncode == 0, ran.stderr
    pages = {path.relative_to(tmp_path / "site").with_suffix("") for path in (tmp_path / "site").rglob("*.html")}
    assert {path.relative_to(ROOT / "docs").with_suffix("") for path in (ROOT / "docs").rglob("*.md")} <= pages
    for path in (tmp_path / "site").rglob("*.html"):
        assert not LOADED.search(path.read_text(encoding="utf-8")), path
    reference = (tmp_path / "site" / "api.html").read_text(encoding="utf-8")
    for name in ("calibrate", "compare", "diagnose", "discover", "replay", "FixedLagEstimator"):
        assert f'id="jointscope.{name}"' in reference, name


def test_a_link_that_leads_nowhere_stops_the_site(tmp_path):
    (tmp_path / "pages").mkdir()
    text = (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")
    (tmp_path / "pages" / "conf.py").write_text(text, encoding="utf-8")
    (tmp_path / "pages" / "index.md").write_text("# Page\n\n[here](nowhere.md)\n", encoding="utf-8")
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--quiet", tmp_path / "pages", tmp_path / "site"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert ran.returncode != 0 and "nowhere.md" in ran.stderr


def test_the_citation_is_of_this_version_and_names_the_three_papers():
    cited = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert cited["version"] == project["version"] and cited["license"] == project["license"]
    assert len(cited["references"]) == 3
    assert all(reference["authors"] and reference["title"] for reference in cited["references"])
