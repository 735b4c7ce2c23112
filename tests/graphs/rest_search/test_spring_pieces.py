# SPDX-License-Identifier: BSD-3-Clause
"""Springs whose curves no polynomial has, hung with weights: which law they deserve is told by what was left out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
import pytest
from lever_bench import lever as lever_with_curve
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from jointscope.graphs.rest_search.discover_rests import discover_rests
from jointscope.graphs.rest_sets.rest_curves import spring_curves
from jointscope.robots.files.effect_editing import remove_effect
from jointscope.robots.rests.rests import Rests
from jointscope.tools.report.sections.calibration.rest_pictures import rest_pictures

C0 = 0.3  # [N m] of friction


@dataclass(frozen=True)
class Ropes:
    """A lever between two ropes and a safety string: torque over deflection as a table [rad], [N m]."""

    deflection: tuple[float, ...]
    torque: tuple[float, ...]
    smooth: bool = True

    def __call__(self, d):
        if self.smooth:
            return PchipInterpolator(self.deflection, self.torque, extrapolate=True)(d)
        return np.interp(d, self.deflection, self.torque)

    def hanging(self, count: int, seed: int, path: str = "bench") -> Rests:
        """Rests with weights over a pulley; friction anywhere in its band."""
        rng = np.random.default_rng(seed)
        pull = rng.choice([0.0, 4.0, 8.0, 12.0, -4.0, -8.0, -12.0], count)
        motor, link, u = np.zeros((3, count, 1))
        for k in range(count):
            q = rng.uniform(-1.0, 1.0)
            load = -9.81 * 2.0 * 0.3 * np.sin(q) - pull[k] * 0.5 * np.cos(q)
            d = brentq(lambda d, load=load: float(self(d)) - load, self.deflection[0], self.deflection[-1])
            motor[k], link[k] = q - d + 1e-5 * rng.normal(), q + 2e-4 * rng.normal()
            u[k] = C0 * rng.uniform(-1.0, 1.0) - load
        zero = np.zeros((count, 1))
        return Rests(
            path, path, np.zeros((count, 2)), motor, link, u, zero, zero, zero,
            np.column_stack([pull, 0.0 * pull, 0.0 * pull]), ("hook",) * count, np.ones((count, 1), dtype=bool), zero,
        )  # fmt: skip


# two ropes that harden by an exponential law each its own way, as a soft tissue or a cable that settles does
X = np.linspace(-0.4, 0.4, 201)
TOE = Ropes(tuple(X), tuple(np.where(X > 0.0, 2.4 * np.expm1(X / 0.08), -14.0 * np.expm1(-X / 0.2))))
# straight ropes, one half as stiff again as the other, and a second coil from 0.1 rad on
COILS = Ropes((-0.5, 0.0, 0.1, 0.5), (-30.0, 0.0, 4.0, 52.0), smooth=False)
# a straight spring of 40 N m/rad and a string of 360 N m/rad, which is taut from -0.13 and from 0.1 rad on
STRING = Ropes((-0.3, -0.13, 0.1, 0.3), (-73.2, -5.2, 4.0, 84.0), smooth=False)


@pytest.fixture
def lever(tmp_path):
    return reduce(remove_effect, ("spring_curve@swing", "weight_dependent_friction@swing"), lever_with_curve(tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "seed", "family", "share"),
    [(TOE, 1, "spring_pieces", 0.01), (COILS, 1, "spring_pieces", 0.01), (STRING, 3, "spring_limit", 0.03)],
    ids=["exponential ropes", "coils", "string"],
)
def test_the_curve_of_a_spring_comes_out_with_a_band_that_holds(lever, truth, seed, family, share):
    found = discover_rests(lever, [truth.hanging(60, seed)], [truth.hanging(30, 7, "other")])
    assert found.steps[1].added.label.startswith(family) and found.adequate
    last = found.steps[-1]
    problems = [problem.of_robot(last.result.robot) for problem in last.result.problems]
    (curve,) = spring_curves(problems, last.result.covariance)
    true = np.asarray(truth(curve.x))
    assert np.max(np.abs(curve.y - true)) < share * np.max(np.abs(true))
    assert np.all(np.diff(curve.y) > 0.0)
    # a band over 60 rests: the corner of a table is rounded by any law with finitely many knots
    assert np.mean(np.abs(curve.y - true) < 2.0 * curve.sigma + 0.003 * np.max(np.abs(true))) > 0.9
    springs = rest_pictures(problems, last.result.covariance)[0]
    assert springs.id == "springs" and "two sigmas" in springs.lead
    assert found.errors(last, found.holdout).error < 1.3


@pytest.mark.slow
def test_a_polynomial_is_preferred_where_it_is_enough(lever):
    x = np.linspace(-0.5, 0.5, 801)
    truth = Ropes(tuple(x), tuple(40.0 * x - 25.0 * x**2 + 300.0 * x**3))
    found = discover_rests(lever, [truth.hanging(60, 4)])
    (added,) = [step.added for step in found.steps if step.added]
    assert added.label in ("spring_curve@swing", "spring_cubic@swing") and found.adequate


@pytest.mark.slow
def test_knots_lie_where_the_spring_was_deflected(lever):
    rests = TOE.hanging(60, 1)
    found = discover_rests(lever, [rests])
    d = (rests.q_link - rests.q_motor)[:, 0]
    effect = found.robot.effects[-1]
    for side, far in (("forward", d.max()), ("backward", -d.min())):
        knot = found.robot.parameters[effect.parameter(side)]
        assert knot.value == pytest.approx(far, rel=0.01) and knot.fixed
