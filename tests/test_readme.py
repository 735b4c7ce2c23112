# SPDX-License-Identifier: BSD-3-Clause
"""README and docs: the first steps do what they say, links and make targets exist."""

from __future__ import annotations

import re

import pytest
from page_commands import EXECUTED, PAGES, ROOT, check_commands, named, pictures, text_of

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


@pytest.mark.parametrize("page", [*PAGES, *sorted((ROOT / "examples").rglob("*.md"))], ids=named)
def test_every_block_of_commands_names_what_executes_it(page):
    """A test that knows the page or its mark, or a target of make; what it names is there."""
    lines = text_of(page).splitlines()
    typed = re.compile(r"(jointscope|python|pip|make) ")
    fences = [i for i, line in enumerate(lines) if line.startswith("```")][::2]
    blocks = [i for i in fences if re.match(r"```(bash|sh|console|python)\b", lines[i]) or typed.match(lines[i + 1])]
    for i in blocks:
        mark = re.fullmatch(r"<!-- executed by (\S+)(?: (\S+))? -->", lines[i - 1])
        assert mark, f"{named(page)}:{i + 1}"
        if mark[1] == "make":
            targets = [mark[2]] if mark[2] else re.findall(r"^make ([\w-]+)", "\n".join(lines[i:]), re.MULTILINE)
            assert targets and all(re.search(f"^{t}:", text_of(ROOT / "Makefile"), re.MULTILINE) for t in targets)
        else:
            test = text_of(ROOT / mark[1])
            assert "page_commands" in test or page.name in test, f"{named(page)}:{i + 1}"


@pytest.mark.parametrize("name", ["first_steps", "is_it_good", "export", "notebook", "rests"])
def test_pages_show_what_their_commands_draw(name):
    page = ROOT / "docs" / f"{name}.md"
    assert pictures(page)
    folders = {made.parts[0] for made in pictures(page).values() if len(made.parts) > 1}
    assert all(re.search(rf"--figures {folder}\b", text_of(page)) for folder in folders)
    files = [made.name for made in pictures(page).values() if len(made.parts) == 1]
    assert all(re.search(rf"savefig\(\"{file}\"\)", text_of(page)) for file in files)


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text_of(page)):
        assert (page.parent / link).exists(), link


def test_the_figures_of_the_story_are_those_that_its_benchmark_wrote():
    section = re.search(
        r"<!-- bench_story -->(.*?)<!-- end of bench_story -->", text_of(ROOT / "docs/measured.md"), re.DOTALL
    )
    assert section
    steps = [line.strip("| ").split() for line in section[1].splitlines() if re.match(r"\| (base|\+|-) ", line)]
    errors = [[float(cell) for cell in step if re.fullmatch(r"[\d.]+", cell)] for step in steps]
    words = " ".join(text_of(ROOT / "README.md").split())
    said = re.search(
        r"error falls from ([\d.]+) to ([\d.]+) sensor sigmas, where noise alone would leave (\d+\.\d+)", words
    )
    assert said and [float(figure) for figure in said.groups()] == [errors[0][1], errors[-1][1], errors[-1][2]]
    drawn = re.findall(r">([\d.]+) σ<", text_of(ROOT / "docs/pictures/story.svg"))
    assert list(map(float, drawn)) == [figure for step in errors for figure in step[:2]]
