# SPDX-License-Identifier: BSD-3-Clause
"""Threads of the solver: as many as are allowed, results in order, failures as without them."""

from __future__ import annotations

import pickle
import platform
import threading
from pathlib import Path

import numpy as np
import pytest

from jointscope.graphs.solving.solver_context import (
    LIMITS,
    available_cores,
    give_back_memory,
    side_by_side,
    thread_count,
    work_alone,
)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_results_come_in_the_order_of_the_tasks(threads):
    assert list(side_by_side(lambda i: i * i, range(50), threads)) == [i * i for i in range(50)]


def test_two_tasks_are_worked_on_at_once():
    both = threading.Barrier(2, timeout=20.0)
    assert sorted(side_by_side(lambda _: both.wait(), range(2), 2)) == [0, 1]


def test_tasks_are_taken_as_they_are_needed():
    taken = []
    tasks = (taken.append(i) or i for i in range(100))
    results = side_by_side(lambda i: i, tasks, 2)
    assert next(results) == 0 and len(taken) < 10
    results.close()


def test_who_asks_from_within_a_task_waits_for_nobody():
    def outer(i):
        return sum(side_by_side(lambda k: k, range(i), 2))

    assert list(side_by_side(outer, range(8), 2)) == [sum(range(i)) for i in range(8)]


def test_the_first_failure_is_the_one_that_is_told():
    def fail(i):
        if i > 2:
            raise ValueError(str(i))
        return i

    with pytest.raises(ValueError, match="3"):
        list(side_by_side(fail, range(20), 2))


def test_threads_warn_as_little_as_who_asks_them():
    with np.errstate(all="raise"), pytest.raises(FloatingPointError):
        list(side_by_side(lambda x: np.ones(1) / x, [np.zeros(1)] * 3, 2))
    with np.errstate(all="ignore"):
        assert np.isinf(np.concatenate(list(side_by_side(lambda x: np.ones(1) / x, [np.zeros(1)] * 3, 2)))).all()


@pytest.mark.parametrize(
    ("said", "count"), [({}, None), ({LIMITS[0]: "1"}, 1), ({LIMITS[1]: "1"}, 1), ({LIMITS[0]: "x"}, None)]
)
def test_there_are_as_many_threads_as_the_environment_allows(monkeypatch, said, count):
    for name in LIMITS:
        monkeypatch.delenv(name, raising=False)
    for name, value in said.items():
        monkeypatch.setenv(name, value)
    assert thread_count() == (count or available_cores())


def test_a_process_among_many_works_alone(monkeypatch):
    monkeypatch.setenv(LIMITS[0], "4")
    work_alone()
    assert thread_count() == 1


def test_each_thread_has_a_workspace_of_its_own(doggy):
    """Pinocchio leaves its results there, where another thread might write before they are copied."""
    both = threading.Barrier(2, timeout=20.0)

    def workspace(_):
        both.wait()
        return doggy.tree.own.data

    assert len({id(data) for data in (*side_by_side(workspace, range(2), 2), doggy.tree.own.data)}) == 3
    assert pickle.loads(pickle.dumps(doggy.tree.own)).model == doggy.tree.own.model


@pytest.mark.skipif(not Path("/proc/self/statm").exists() or platform.libc_ver()[0] != "glibc", reason="needs glibc")
def test_freed_memory_goes_back_to_the_system():
    """Pieces that are freed between others that stay: without the call the C library keeps all of them."""

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

    def left(call):
        pieces = [np.ones(12_000) for _ in range(2000)]  # 96 kB each: below the size that is mapped on its own
        kept = pieces[::10]
        pieces.clear()
        call()
        return resident(), kept

    before, kept = left(lambda: None)
    give_back_memory()
    assert resident() < before - 50e6
    assert len(kept) == 200
