# SPDX-License-Identifier: BSD-3-Clause
"""Errors against their floors: below it is noise, unless the noise is so large that a missing effect may hide in it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from jointscope.graphs.discovery import unexplained as module
from jointscope.graphs.discovery.diagnosis_words import why_it_stopped
from jointscope.graphs.discovery.unexplained import believed_floor, unexplained, unexplained_share

RECORDING = SimpleNamespace()


@pytest.fixture
def compared(monkeypatch):
    """A comparison with this error and floor, of a model with this random torque."""

    def of(error, floor, torque):
        monkeypatch.setattr(module, "random_torque", lambda robot, recording: torque)
        return SimpleNamespace(judged_error=error, judged_floor=floor, robot=None)

    return of


def test_an_error_below_the_floor_of_random_torques_that_hide_nothing_is_noise(compared):
    fine_encoder = compared(1.57, 2.46, 2e-4)
    assert believed_floor(fine_encoder, RECORDING) == 2.46
    assert unexplained(fine_encoder, RECORDING) == 0.0
    assert believed_floor(fine_encoder, None) == 1.0  # nothing tells how large the torques are


def test_a_floor_well_above_the_error_by_large_random_torques_is_not_believed(compared):
    swollen = compared(2.0, 5.0, 0.02)
    assert believed_floor(swollen, RECORDING) == 1.0
    assert unexplained(swollen, RECORDING) == pytest.approx(0.75)


def test_a_floor_near_the_error_is_believed_whatever_the_torques(compared):
    assert believed_floor(compared(2.0, 2.1, 0.5), None) == 2.1
    assert unexplained_share(2.0, 1.0) == pytest.approx(0.75)


def test_random_torques_of_a_robot_are_parts_of_what_its_drives_give(doggy):
    import numpy as np

    def used(size):
        return SimpleNamespace(command=SimpleNamespace(values=np.full((10, doggy.n), size)))

    half, full = module.random_torque(doggy, used(0.5)), module.random_torque(doggy, used(1.0))
    assert half == pytest.approx(2.0 * full)
    assert module.random_torque(doggy, used(0.0)) == float("inf")


@pytest.mark.parametrize(("adequate", "begins"), [(True, "the model is adequate: no more than "), (False, "nothing")])
def test_where_torques_judge_the_end_of_a_search_says_how_much_of_them_is_missing(adequate, begins):
    percent = {"j1": 0.2, "j2": 0.94}
    diagnosis = SimpleNamespace(adequate=adequate, missing_torque_percent=percent, unexplained_share=0.0)
    said = why_it_stopped(diagnosis)
    assert said.startswith(begins) and "0.94 % of the drive's torque is missing at j2" in said
