# SPDX-License-Identifier: BSD-3-Clause
"""Where nothing is asked to hold, velocities are free however small the noise of the model is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.step import FREE, Steps


@pytest.mark.parametrize("share", (1.0, 1e-9))
def test_rows_that_nothing_binds_are_free_and_all_others_as_they_were(doggy, share):
    noise = replace(
        doggy.noise,
        link_velocity=share * np.asarray(doggy.noise.link_velocity),
        motor_velocity=share * np.asarray(doggy.noise.motor_velocity),
    )
    steps = Steps(np.full(4, 2.5e-3), np.zeros((4, doggy.n)), noise, doggy.layout)
    k = len(doggy.layout.velocities)
    slack = np.ones((4, k))
    slack[1], slack[2, 0] = 1e3, 1e3
    free = replace(steps, slack=slack).sigmas
    np.testing.assert_array_equal(free[[0, 3]], steps.sigmas[[0, 3]])
    np.testing.assert_array_equal(free[2, 1:k], steps.sigmas[2, 1:k])
    wanted = np.maximum(1e3 * steps.sigmas[1, :k], FREE * np.sqrt(2.5e-3))
    np.testing.assert_allclose(free[1, :k], wanted)
    np.testing.assert_allclose(free[2, 0], wanted[0])
