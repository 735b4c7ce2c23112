# SPDX-License-Identifier: BSD-3-Clause
"""Errors of a model's response: decibels, sigmas and floors of known matrices."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.frequency.compare_frequency import FrequencyErrors, entries, errors_json
from jointscope.graphs.frequency.explained import PoseFit
from jointscope.graphs.responses.response_matrix import ResponseMatrix

LINES, FREQUENCIES = 3, np.array([10.0, 20.0, 30.0])


def errors(factor, relative=0.1, path="P1"):
    """A model that is `factor` times the measured matrix, known to a share of itself; the middle line is left out."""
    rng = np.random.default_rng(0)
    G = rng.standard_normal((LINES, 2, 2)) + 1j * rng.standard_normal((LINES, 2, 2))
    total = np.zeros((LINES, 4, 4), dtype=complex)
    for k in range(LINES):
        total[k] = np.diag((relative * np.abs(G[k]).ravel()) ** 2)
    matrix = ResponseMatrix(FREQUENCIES, G, None, total, G[None], ("a", "b"), ("a", "b"), 2, "a test")
    used = np.array([True, False, True])
    pose = SimpleNamespace(matrix=matrix, used=used, path=path, w=2.0 * np.pi * FREQUENCIES[used])
    fit = PoseFit(path, np.array([0.1, 0.2]), None, (), False)
    return FrequencyErrors(pose, factor * G[used], fit)


@pytest.mark.parametrize(
    ("factor", "db", "sigmas"), [(2.0, 6.0206, 10.0), (1.1, 0.8279, 1.0), (np.exp(0.1j), 0.0, 0.9996)]
)
def test_decibels_are_of_the_size_and_sigmas_of_the_distance(factor, db, sigmas):
    found = entries([errors(factor)])
    assert set(found) == {"1,1", "1,2", "2,1", "2,2"}
    for entry in found.values():
        assert entry["db"] == pytest.approx(db, abs=1e-3)
        assert entry["sigmas"] == pytest.approx(sigmas, rel=1e-3)
        assert entry["rms_log"] == pytest.approx(abs(np.log(factor)), rel=1e-9)


def test_the_floor_is_what_a_known_spread_makes_of_sizes():
    rng = np.random.default_rng(1)
    spread = 0.02 * (rng.standard_normal(100_000) + 1j * rng.standard_normal(100_000)) / np.sqrt(2.0)
    expected = np.sqrt(np.mean((20.0 * np.log10(np.abs(1.0 + spread))) ** 2))
    assert entries([errors(1.0, 0.02)])["1,2"]["floor_db"] == pytest.approx(expected, rel=0.02)


def test_json_has_what_the_interface_promises_and_poses_count_alike():
    content = errors_json([errors(2.0), errors(1.0, path="P3")])
    assert content["entries"]["1,2"] == pytest.approx(np.log(2.0) / np.sqrt(2.0))
    assert content["rms_log"] == pytest.approx(np.log(2.0) / np.sqrt(2.0))
    assert content["lines"]["P1"]["frequencies"] == pytest.approx([10.0, 30.0])
    assert np.shape(content["lines"]["P3"]["sigmas"]) == (2, 2, 2)
    assert content["balance"]["P1"] == {"left": [0.1, 0.2], "over_noise": None}
