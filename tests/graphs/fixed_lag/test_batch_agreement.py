# SPDX-License-Identifier: BSD-3-Clause
"""States of the batch between its ticks, with which those at the lag are compared."""

from __future__ import annotations

import numpy as np

from jointscope.graphs.fixed_lag.replay.batch_agreement import _between


def test_states_between_ticks_follow_the_motion_and_not_its_chord(doggy):
    """At 20 rad/s^2 a chord over 2.5 ms is off by 16 urad, three sigmas of a fine encoder's states."""
    layout, ticks = doggy.layout, np.arange(5) * 2.5e-3

    def moved(t):
        x = np.zeros((len(t), layout.size))
        x[:, layout.positions] = (10.0 * t**2 + 40.0 * t**3)[:, None]
        x[:, layout.velocities] = (20.0 * t + 120.0 * t**2)[:, None]
        return x

    at = np.array([0.0, 1.1e-3, 4.0e-3, 1e-2])
    np.testing.assert_allclose(_between(layout, ticks, moved(ticks), at), moved(at), atol=1e-12)
