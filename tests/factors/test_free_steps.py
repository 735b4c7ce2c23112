# SPDX-License-Identifier: BSD-3-Clause
"""Where nothing is asked to hold, velocities are free however small the noise of the model is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.step import Steps


@pytest.mark.parametrize("share", (1.0, 1e-9))
def test_rows_that_nothing_binds_are_free_and_all_others_as_they_were(doggy, share):
    noise = replace(
        doggy.noise,
        link_velocity=share * np.asarray(doggy.noise.link_velocity),
        motor_velocity=share * np.asarray(doggy.noise.motor_velocity),
    )
    steps = Steps(np.full(4, 2.5e-3), np.zeros((4, doggy.n)), noise, doggy.layout)
    k = len(doggy.layout.velocities)
    free = np.zeros((4, k))
    free[1], free[2, 0] = 20.0, 0.5
    sigmas = replace(steps, free=free).sigmas
    np.testing.assert_array_equal(sigmas[[0, 3]], steps.sigmas[[0, 3]])
    np.testing.assert_array_equal(sigmas[2, 1:k], steps.sigmas[2, 1:k])
    np.testing.assert_allclose(sigmas[1, :k], 20.0 * np.sqrt(2.5e-3))
    assert sigmas[2, 0] == pytest.approx(0.5 * np.sqrt(2.5e-3))
