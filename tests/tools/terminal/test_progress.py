# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import io

import pytest

from jointscope.tools.terminal import progress
from jointscope.tools.terminal.progress import ERASE_LINE, progress_bar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand [s]."""
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_the_bar_appears_after_two_seconds_and_goes_away(clock):
    terminal = Terminal()
    with progress_bar(terminal) as show:
        clock[0] += 1.9
        show("reading", 0.2)
        assert terminal.getvalue() == ""
        clock[0] += 0.2
        show("solving", 0.5)
        assert terminal.getvalue() == f"{ERASE_LINE}[###############               ]  50%    2 s  solving"
    assert terminal.getvalue().endswith(ERASE_LINE)


def test_it_is_drawn_at_most_ten_times_a_second(clock):
    terminal = Terminal()
    with progress_bar(terminal) as show:
        clock[0] += 3.0
        for k in range(1000):
            show("solving", k / 1000)
    assert terminal.getvalue().count("solving") == 1


def test_nothing_is_drawn_where_no_terminal_is(clock):
    log = io.StringIO()
    with progress_bar(log) as show:
        clock[0] += 60.0
        show("solving", 0.5)
    assert log.getvalue() == ""


def test_the_line_is_clean_again_after_an_error(clock):
    terminal = Terminal()
    with pytest.raises(ValueError, match="broken"), progress_bar(terminal) as show:
        clock[0] += 3.0
        show("solving", 0.5)
        raise ValueError("broken")
    assert terminal.getvalue().endswith(ERASE_LINE)
