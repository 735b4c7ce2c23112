# SPDX-License-Identifier: BSD-3-Clause
"""Where nothing is asked to hold, velocities are free however small the noise of the model is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.step import FREE, Steps


@pytest.mark.parametrize("share", (1.0, 1e-9))
def test_steps_that_are_left_out_are_free_and_all_others_as_they_were(doggy, share):
    noise = replace(
        doggy.noise,
        link_velocity=share * np.asarray(doggy.noise.link_velocity),
        motor_velocity=share * np.asarray(doggy.noise.motor_velocity),
    )
    steps = Steps(np.full(4, 2.5e-3), np.zeros((4, doggy.n)), noise, doggy.layout)
    free = replace(steps, slack=np.array([1.0, 1e3, 1e3, 1.0])).sigmas
    k = len(doggy.layout.velocities)
    np.testing.assert_array_equal(free[[0, 3]], steps.sigmas[[0, 3]])
    wanted = np.maximum(1e3 * steps.sigmas[1, :k], FREE * np.sqrt(2.5e-3))
    np.testing.assert_allclose(free[1:3, :k], np.tile(wanted, (2, 1)))
