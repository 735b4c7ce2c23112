# SPDX-License-Identifier: BSD-3-Clause
"""Commands of the docs do what they say; the first steps are in `test_readme.py`, so that two cores share the pages."""

from __future__ import annotations

import json
import re

import pytest
from page_commands import EXECUTED, ROOT, check_commands, lines_of, named, run, text_of

from jointscope.tools.acceptance.evaluation import FAIL, FAILED, OPEN, UNDECIDED

pytest.importorskip("mujoco", reason="the pages simulate their recordings")


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in EXECUTED if page.stem != "first_steps"], ids=named)
def test_the_commands_of_a_page_work_and_write_what_they_name(page, tmp_path):
    check_commands(page, tmp_path)


@pytest.mark.slow
def test_the_limits_of_their_page_are_checked_as_it_says(tmp_path):
    """Its file of limits as printed; some lines are about what the commands do not compute."""
    text = text_of(ROOT / "docs" / "accept.md")
    (block,) = re.findall(r"<!-- executed by tests/test_docs_pages.py -->\n```bash\n(.*?)```", text, re.DOTALL)
    (limits,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    (tmp_path / "limits.yaml").write_text(limits)
    for command in (
        "jointscope simulate doggy -o moves.mcap --seconds 5 --seed 2 --friction smooth",
        "jointscope simulate doggy -o other_moves.mcap --motion moves --seconds 4 --seed 2 --friction smooth",
        "jointscope robots doggy > arm.yaml",
        "cp arm.yaml arm_january.yaml",
    ):
        assert run(command, tmp_path).returncode == 0
    printed = re.findall(r"^  (pass|fail|not evaluated) +(\S+)", text, re.MULTILINE)
    for k, command in enumerate(lines_of(block)):
        done = run(f"{command} --json told.json", tmp_path)
        (lines,) = json.loads((tmp_path / "told.json").read_text())["acceptance"].values()
        outcomes = [line["outcome"] for line in lines]
        assert len(outcomes) >= limits.count("- {")
        assert k or [(line["outcome"], line["name"]) for line in lines] == printed
        assert done.returncode == (FAILED if FAIL in outcomes else UNDECIDED if OPEN in outcomes else 0)
        assert done.returncode in (FAILED, UNDECIDED)  # no command computes what every line is about
        assert done.stderr == ""
    assert (tmp_path / "arm_calibrated.yaml").is_file() and (tmp_path / "calibration.html").is_file()
