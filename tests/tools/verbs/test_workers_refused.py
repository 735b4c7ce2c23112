# SPDX-License-Identifier: BSD-3-Clause
"""--workers and --scheduler where they cannot be had: one line, exit code 1, nothing written, at once."""

from __future__ import annotations

import sys
import time

import pytest

from jointscope.graphs.spread.memory_needed import must_fit, must_fit_here
from jointscope.robots.errors import ClusterError, RecordingError
from jointscope.tools.command_line import main

VERBS = {"calibrate": ["-o", "out.yaml"], "diagnose": ["--json", "out.json"], "discover": ["-o", "out.yaml"]}


def refused(arguments, capsys, folder):
    before = set(folder.iterdir())
    assert main([*map(str, arguments)]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert set(folder.iterdir()) == before
    return error


@pytest.mark.parametrize("verb", VERBS)
def test_a_scheduler_that_does_not_answer_is_named_before_bags_are_read(verb, tmp_path, monkeypatch, capsys):
    pytest.importorskip("distributed", reason="clusters need the extra `cluster`")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bag.mcap").touch()
    begun = time.monotonic()
    arguments = [verb, "doggy", "bag.mcap", *VERBS[verb], "--scheduler", "tcp://127.0.0.1:9"]
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in refused(arguments, capsys, tmp_path)
    assert time.monotonic() - begun < 15.0


def test_a_missing_extra_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "distributed", None)
    (tmp_path / "bag.mcap").touch()
    arguments = ["calibrate", "doggy", "bag.mcap", "-o", "out.yaml", "--scheduler", "tcp://127.0.0.1:9"]
    assert 'pip install "jointscope[cluster]"' in refused(arguments, capsys, tmp_path)


def test_what_does_not_go_together_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bag.mcap").touch()
    start = ["calibrate", "doggy", "bag.mcap", "-o", "out.yaml", "--workers", 2]
    assert "give one of them" in refused([*start, "--scheduler", "tcp://127.0.0.1:9"], capsys, tmp_path)
    assert "solves in this process alone" in refused([*start, "--incremental"], capsys, tmp_path)


class Small:
    """Two workers with 1 MB each."""

    name, slots = "workers of tcp://small:8786", 2
    memories = ((1e6, [0]), (1e6, [1]))


def test_recordings_that_workers_cannot_keep_are_refused(simulated, doggy):
    pieces = [simulated.recording.between(t, t + 2.0) for t in (0.0, 2.0, 4.0)]
    with pytest.raises(ClusterError, match=r"workers of tcp://small:8786: \d of 3 recordings need about 0\.\d GB"):
        must_fit(Small(), doggy, pieces)


def test_recordings_that_this_machine_cannot_hold_are_refused(simulated, doggy, monkeypatch):
    from jointscope.graphs.spread import memory_needed

    must_fit_here(doggy, [simulated.recording])
    monkeypatch.setattr(memory_needed, "available_memory", lambda: 1e6)
    with pytest.raises(RecordingError, match=r"1 recordings with 8 s need at least .* GB are left on this machine"):
        must_fit_here(doggy, [simulated.recording])
