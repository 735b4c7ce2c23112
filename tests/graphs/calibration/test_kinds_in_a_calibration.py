# SPDX-License-Identifier: BSD-3-Clause
"""`calibrate` with a recording of another kind beside the motion."""

from __future__ import annotations

import numpy as np
import pytest
from weighed_springs import WeighedSprings

import jointscope as js
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.errors import SolveError


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


def test_weighings_are_in_the_graph_of_a_calibration(simulated, doggy):
    motion = simulated.recording.between(4.5, 5.5)
    torques = np.linspace(-1.0, 3.0, 10)
    dial = torques / simulated.truth["parameters"]["joint1.stiffness"] + 2e-3
    result = calibrate(doggy, [motion], sets=[WeighedSprings(doggy, "joint1", torques, dial, (1e-6, 1e-6))])
    g = js.graph(result)
    assert "rows of weights: dynamics, dial.zero (bag 2)" in g.describe() and "rows of motion: x " in g.describe()
    assert g.values.atVector(g.keys["dial.zero (bag 2)"])[0] == pytest.approx(2e-3, abs=1e-5)
    found, sigmas = g.parameters(g.optimize()), g.sigmas(g.values)
    for p in result.parameters:
        if p.name in found:
            assert found[p.name] == pytest.approx(p.value, abs=1e-2 * p.sigma)
            assert sigmas[p.name] == pytest.approx(p.sigma / result.sigma_inflation[p.name], rel=1e-3)
    with pytest.raises(SolveError, match="takes recordings of motion only; leave it out"):
        js.graph(result, per_sample=True)
