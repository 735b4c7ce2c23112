# SPDX-License-Identifier: BSD-3-Clause
"""Commands of the docs do what they say; the first steps are in `test_readme.py`, so that two cores share the pages."""

from __future__ import annotations

import pytest
from page_commands import EXECUTED, check_commands, named

pytest.importorskip("mujoco", reason="the pages simulate their recordings")


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in EXECUTED if page.stem != "first_steps"], ids=named)
def test_the_commands_of_a_page_work_and_write_what_they_name(page, tmp_path):
    check_commands(page, tmp_path)
