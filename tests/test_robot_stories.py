# SPDX-License-Identifier: BSD-3-Clause
"""Pages about recordings that were made elsewhere: their commands work, and write the pictures that the pages show."""

from __future__ import annotations

import re

import pytest
from page_commands import ROOT, check_pictures, lines_of, pictures, run, text_of

DATA = ROOT.parent / "shared" / "data"
BLOCK = re.compile(r"<!-- executed by tests/test_robot_stories.py -->\n```bash\n(.*?)```", re.DOTALL)
PAGES = {page.stem: page for page in sorted((ROOT / "docs").rglob("*.md")) if BLOCK.search(text_of(page))}
RECORDINGS = {"rests": "biorob", "hebi": "real/hebi_arms_mit", "kr300": "real/kr300", "xl330": "real/bam_xl330"}
WITH_PICTURES = ("biorob", "rests", "tx90l")


def test_there_are_stories():
    assert {*RECORDINGS, *WITH_PICTURES} <= PAGES.keys()


@pytest.mark.parametrize("name", WITH_PICTURES)
def test_every_picture_of_a_story_is_there(name):
    shown = pictures(PAGES[name])
    assert shown
    assert all((ROOT / "docs" / "pictures" / "robots" / picture).is_file() for picture in shown)


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_the_commands_of_a_story_work_and_draw_its_pictures(name, tmp_path):
    recordings = DATA / RECORDINGS.get(name, name)
    if not recordings.is_dir():
        pytest.skip("needs recordings that are not part of this repository")
    for entry in recordings.iterdir():
        (tmp_path / entry.name).symlink_to(entry)
    commands = [line for block in BLOCK.findall(text_of(PAGES[name])) for line in lines_of(block)]
    for command in commands:
        done = run(command, tmp_path)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    check_pictures(PAGES[name], tmp_path)
