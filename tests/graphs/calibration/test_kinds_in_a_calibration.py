# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` with a recording of another kind beside the motion."""

from __future__ import annotations

import numpy as np
import pytest
from weighed_springs import WeighedSprings

from jointscope.graphs.calibration.calibrate import calibrate


def test_weighings_make_the_stiffness_of_a_calibration_better_known(simulated, doggy):
    motion = simulated.recording.between(4.5, 5.5)
    truth = simulated.truth["parameters"]["joint1.stiffness"]
    torques = np.linspace(-1.0, 3.0, 10)
    dial = torques / truth + 2e-3 + np.random.default_rng(0).normal(size=10) * 1e-6
    weights = WeighedSprings(doggy, "joint1", torques, dial, (1e-6, 1e-6))
    without, result = calibrate(doggy, [motion]), calibrate(doggy, [motion], sets=[weights])
    before, after = (next(p for p in found.parameters if p.name == "joint1.stiffness") for found in (without, result))
    # information adds up
    of_weights = weights.sigma[0] * truth**2 / np.linalg.norm(torques - torques.mean())
    assert after.sigma < 0.9 * before.sigma
    assert after.sigma == pytest.approx((before.sigma**-2 + of_weights**-2) ** -0.5, rel=0.1)
    assert abs(after.value - truth) < 4.0 * after.sigma
    assert result.samples == without.samples + 10
    # every shared value has a name of its own, that of the dial's zero included
    assert len(set(result.names)) == len(result.names) == len(result.correlation)
    assert set(result.names) - set(without.names) == {"dial.zero.0"}
