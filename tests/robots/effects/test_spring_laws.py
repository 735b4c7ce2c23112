# SPDX-License-Identifier: BSD-3-Clause
"""Springs of pieces and strings: they always grow, give back what was put in, and are what their knots say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from jointscope.robots.effect_kinds.joint_torque import JointSignals
from jointscope.robots.files.effect_catalogue import catalogue

PIECES = (1, 2, 4)
K = 150.0


def spring(d, gap=None):
    zero = np.zeros_like(d)
    return JointSignals(
        q_link=d, v_link=zero, q_motor=zero, v_motor=zero, tau_spring=K * np.real(d), stiffness=K, gap=gap
    )


def drawn(effect, rng):
    values = {p.name: rng.uniform(-6.0, 6.0) for p in effect.parameters if not p.is_shape}
    return values | {"forward": rng.uniform(0.01, 0.2), "backward": rng.uniform(0.01, 0.2)}


@pytest.mark.parametrize("pieces", PIECES)
@pytest.mark.parametrize("seed", range(5))
def test_the_torque_grows_with_the_deflection_whatever_the_values_are(pieces, seed):
    effect, rng = catalogue()[f"spring_pieces_{pieces}"], np.random.default_rng(seed)
    d = np.linspace(-0.4, 0.4, 4001)
    total = K * d + effect.law(spring(d), drawn(effect, rng))
    assert np.all(np.diff(total) > 0.0)
    slack = 0.02, 0.03
    behind = K * spring(d, slack).deflection + effect.law(spring(d, slack), drawn(effect, rng))
    assert np.all(np.diff(behind) > -1e-12) and np.all(np.diff(behind)[np.abs(d[1:]) > 0.05] > 0.0)


@pytest.mark.parametrize("pieces", PIECES)
def test_the_torque_is_the_integral_of_slopes_that_go_straight_from_knot_to_knot(pieces):
    effect, rng = catalogue()[f"spring_pieces_{pieces}"], np.random.default_rng(pieces)
    p = drawn(effect, rng)

    def slope(h):
        return K * (1.0 + h) if h > 0.0 else K * np.exp(h)

    knots = np.linspace(0.0, 1.0, pieces + 1)
    forward = [K, *(slope(p[f"forward_{k}"]) for k in range(1, pieces + 1))]
    backward = [slope(p[name]) for name in ("turn", *(f"backward_{k}" for k in range(1, pieces + 1)))]
    for x in (0.3 * p["forward"], p["forward"], 1.7 * p["forward"]):
        expected = quad(lambda t: np.interp(t, knots * p["forward"], forward), 0.0, x, points=knots * p["forward"])[0]
        assert K * x + effect.law(spring(np.array([x])), p)[0] == pytest.approx(expected, rel=1e-6)
    for x in (0.3 * p["backward"], p["backward"], 1.7 * p["backward"]):
        expected = -quad(lambda t: np.interp(t, knots * p["backward"], backward), 0.0, x, points=knots * p["backward"])[
            0
        ]
        assert -K * x + effect.law(spring(np.array([-x])), p)[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("coarse", "fine"), [(1, 2), (1, 4), (2, 4)])
@pytest.mark.parametrize("seed", range(3))
def test_a_finer_member_can_be_the_coarser_one(coarse, fine, seed):
    rough, effect = catalogue()[f"spring_pieces_{coarse}"], catalogue()[f"spring_pieces_{fine}"]
    p = drawn(rough, np.random.default_rng(seed))
    d = np.linspace(-0.3, 0.3, 501)
    same = effect.refined(rough, p)
    assert set(same) == {parameter.name for parameter in effect.parameters}
    np.testing.assert_allclose(effect.law(spring(d), same), rough.law(spring(d), p), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("effect_id", [*(f"spring_pieces_{n}" for n in PIECES), "spring_limit"])
def test_a_cycle_of_deflections_takes_no_energy(effect_id):
    effect = catalogue()[effect_id]
    t = np.linspace(0.0, 2.0 * np.pi, 20001)
    d, rate = 0.06 * np.sin(t) + 0.02 * np.sin(3.0 * t), 0.06 * np.cos(t) + 0.06 * np.cos(3.0 * t)
    moving = replace(spring(d), v_link=rate, v_motor=0.3 * np.sin(t))
    power = effect.law(moving, dict(effect.example)) * rate
    assert abs(np.trapezoid(power, t)) < 1e-6 * np.trapezoid(np.abs(power), t)


def test_a_string_is_taut_beyond_its_length_only():
    law, d = catalogue()["spring_limit"].law, np.array([-0.1, -0.029, 0.0, 0.015, 0.07])
    p = {"stiffness": 400.0, "forward": 0.02, "backward": 0.03}
    np.testing.assert_allclose(law(spring(d), p), 400.0 * np.array([-0.07, 0.0, 0.0, 0.0, 0.05]), atol=0.05)
    # slack of a rope beside it makes no difference
    np.testing.assert_array_equal(law(spring(d, (0.01, 0.01)), p), law(spring(d), p))
