# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.comparison.predictions_ahead import _target_samples


@pytest.mark.parametrize("behind", (0.5e-3, 2e-3, 5e-3))
def test_predictions_end_at_samples_of_nodes_of_which_one_speaks_just_behind_the_other(behind):
    own = 0.01 * np.arange(100)
    taken = np.sort(np.concatenate([own, own + behind]))
    _, near = _target_samples(taken, 0.01, taken[:150] + 0.1012)
    assert near.all()


def test_no_prediction_ends_in_a_silence():
    taken = np.concatenate([0.01 * np.arange(100), 2.0 + 0.01 * np.arange(100)])
    _, near = _target_samples(taken, 0.01, np.array([0.5, 1.5, 2.5]))
    assert near.tolist() == [True, False, True]
