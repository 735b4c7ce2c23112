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


def test_one_equation_of_a_step_may_be_free_while_the_others_bind(doggy):
    steps = Steps(np.full(2, 2.5e-3), np.zeros((2, doggy.n)), doggy.noise, doggy.layout)
    slack = np.ones((2, len(doggy.layout.velocities)))
    slack[1, 2] = 1e3
    free = replace(steps, slack=slack).sigmas
    changed = free != steps.sigmas
    assert changed[1, 2]
    assert not np.any(np.delete(changed[:, : slack.shape[1]], 2, axis=1))
    assert not np.any(changed[0])
