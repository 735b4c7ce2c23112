# SPDX-License-Identifier: BSD-3-Clause
"""The pages of single robots: their commands work, and write the pictures that the pages show."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from page_commands import ROOT, run, text_of

DATA = ROOT.parent / "shared" / "data"
BLOCK = re.compile(r"<!-- executed by tests/test_robot_stories.py -->\n```bash\n(.*?)```", re.DOTALL)
SHOWN = re.compile(r"\]\(\.\./pictures/robots/([\w.-]+)\)")
PAGES = {page.stem: page for page in (ROOT / "docs" / "real").glob("*.md") if BLOCK.search(text_of(page))}
OPENING = re.compile(r"<text class=\"title\"[^>]*>([^<]*)")


def test_there_are_stories():
    assert {"biorob", "tx90l"} <= PAGES.keys()


@pytest.mark.parametrize("name", PAGES)
def test_every_picture_of_a_story_is_there(name):
    shown = SHOWN.findall(text_of(PAGES[name]))
    assert shown
    assert all((ROOT / "docs" / "pictures" / "robots" / picture).is_file() for picture in shown)


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_the_commands_of_a_story_work_and_draw_its_pictures(name, tmp_path):
    recordings = DATA / name
    if not recordings.is_dir():
        pytest.skip("needs recordings that are not part of this repository")
    for entry in recordings.iterdir():
        (tmp_path / entry.name).symlink_to(entry)
    commands = [line for block in BLOCK.findall(text_of(PAGES[name])) for line in block.splitlines()]
    for command in commands:
        done = run(command, tmp_path)
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    for picture in SHOWN.findall(text_of(PAGES[name])):
        folder, _, file = picture.partition("-")
        assert titles(tmp_path / folder / file) == titles(ROOT / "docs" / "pictures" / "robots" / picture)


def titles(picture: Path) -> list[str]:
    """What a drawing says it shows; numbers in it are those of the machine that drew it."""
    return OPENING.findall(text_of(picture))
