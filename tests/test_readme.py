# SPDX-License-Identifier: BSD-3-Clause
"""README and docs: the first steps do what they say, links and make targets exist."""

from __future__ import annotations

import re

import pytest
from page_commands import EXECUTED, PAGES, ROOT, check_commands, named, text_of

pytest.importorskip("mujoco", reason="the pages simulate their recordings")

FIRST = ROOT / "docs" / "first_steps.md"


@pytest.mark.slow
def test_the_first_steps_work_and_write_what_they_name(tmp_path):
    check_commands(FIRST, tmp_path)


def test_pages_with_commands_are_executed():
    assert FIRST in EXECUTED and len(EXECUTED) > 1


def test_the_make_targets_that_are_named_exist():
    makefile = text_of(ROOT / "Makefile")
    targets = set(re.findall(r"^([\w-]+):", makefile, re.MULTILINE))
    for page in PAGES:
        assert set(re.findall(r"`make ([\w-]+)", text_of(page))) <= targets, page


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text_of(page)):
        assert (page.parent / link).exists(), link
