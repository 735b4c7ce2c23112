# SPDX-License-Identifier: BSD-3-Clause
"""A motor encoder whose zero was never set is told from a spring that deflects by the encoder on the link."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.recordings.recording import Stream
from jointscope.tools.init.estimates.motor_zero import motor_zero

TIMES = np.arange(0.0, 10.0, 0.01)
SIGMAS = np.array([1e-4, 1e-4])


def stream(values: np.ndarray, times: np.ndarray = TIMES) -> Stream:
    return Stream("/joint_states", times, values, ("a", "b"), "")


def links() -> np.ndarray:
    return np.column_stack([np.sin(2.0 * TIMES), 0.4 * np.cos(3.0 * TIMES)])


def test_a_constant_difference_is_the_zero_of_the_motor():
    deflection = 1e-3 * np.column_stack([np.sin(9.0 * TIMES), np.cos(7.0 * TIMES)])
    found = motor_zero(stream(links() + np.array([0.403, 0.0]) + deflection), stream(links()), SIGMAS)
    assert found[0] == pytest.approx(0.403, abs=1e-3)
    assert found[1] == 0.0


def test_a_spring_that_gravity_deflects_is_no_zero():
    sag = 0.02 * np.column_stack([np.cos(2.0 * TIMES) + 2.0, np.sin(3.0 * TIMES) + 1.5])
    assert not motor_zero(stream(links() + sag), stream(links()), SIGMAS).any()


def test_streams_of_other_times_are_brought_together():
    later = TIMES[::2] + 0.003
    moved = np.column_stack([np.sin(2.0 * later), 0.4 * np.cos(3.0 * later)]) - 1.2
    assert motor_zero(stream(moved, later), stream(links()), SIGMAS) == pytest.approx([-1.2, -1.2], abs=1e-4)


def test_streams_that_never_overlap_tell_nothing():
    assert not motor_zero(stream(links(), TIMES + 100.0), stream(links()), SIGMAS).any()
