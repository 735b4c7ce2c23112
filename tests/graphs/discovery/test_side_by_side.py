# SPDX-License-Identifier: BSD-3-Clause
"""Tasks on several processes give what they give one after the other, also where a process dies."""

from __future__ import annotations

import operator
import os
import pickle
import signal

import numpy as np
import pytest

from jointscope.graphs.discovery.side_by_side import SideBySide
from jointscope.graphs.solving.solver_context import available_cores


@pytest.mark.parametrize("workers", (1, 2))
def test_results_come_in_the_order_of_the_tasks(workers):
    with SideBySide(workers) as pool:
        assert list(pool.in_order(divmod, 100, [7, 9, 11])) == [divmod(100, 7), divmod(100, 9), divmod(100, 11)]


def test_who_stops_asking_stops_the_rest():
    with SideBySide(2) as pool:
        results = pool.in_order(divmod, 100, [7, 9, 11, 13])
        assert next(results) == (14, 2)
        results.close()
        assert list(pool.in_order(divmod, 10, [3, 4])) == [(3, 1), (2, 2)]


def test_processes_that_were_begun_do_the_tasks():
    with SideBySide(2) as pool:
        pool.begin(3)
        begun = set(pool._pool._processes)
        assert len(begun) == 2
        assert set(pool.in_order(operator.call, eval, ["__import__('os').getpid()"] * 2)) <= begun


def test_one_process_begins_nothing():
    with SideBySide(1) as pool:
        pool.begin(2)
        assert pool._pool is None


def test_an_error_of_a_task_is_the_callers():
    with SideBySide(2) as pool, pytest.raises(ZeroDivisionError):
        list(pool.in_order(divmod, 1, [1, 0]))


def test_a_worker_that_is_killed_costs_nothing_but_time():
    with SideBySide(2) as pool:
        results = pool.in_order(divmod, 100, [7, 9, 11])
        first = next(results)
        for process in list(pool._pool._processes.values()):
            os.kill(process.pid, signal.SIGKILL)
        assert [first, *results] == [divmod(100, 7), divmod(100, 9), divmod(100, 11)]


def test_a_calibration_goes_to_another_process(doggy):
    from jointscope.factors.calibration import Calibration

    calibration = Calibration.of(doggy)
    again = pickle.loads(pickle.dumps(calibration))
    assert again.layout == calibration.layout
    assert all(np.array_equal(again[name], calibration[name]) for name in calibration.layout)


def test_there_is_a_core():
    assert available_cores() >= 1


def test_a_robot_with_every_effect_of_a_joint_goes_to_another_process(doggy):
    from jointscope.robots.effect_kinds.effect_at import EffectAt
    from jointscope.robots.files.effect_catalogue import catalogue
    from jointscope.robots.files.effect_editing import add_effect, cannot_be_added

    for effect in catalogue().values():
        owner = next(iter(effect.owners_of(doggy)), None)
        if owner is None or cannot_be_added(doggy, EffectAt(effect, owner)):
            continue
        robot = add_effect(doggy, f"{effect.id}@{owner}")
        again = pickle.loads(pickle.dumps(robot))
        assert again.has_effect(effect.id, owner)
        assert np.array_equal(again.tree.mass_matrix(np.ones((1, 3))), robot.tree.mass_matrix(np.ones((1, 3))))
