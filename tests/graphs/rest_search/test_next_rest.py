# SPDX-License-Identifier: BSD-3-Clause
"""Rests that are advised tell about as much as is promised, on arms whose equilibria are worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, C1, K2, K3, K, hanging, lever
from scipy.optimize import brentq
from two_levers import BETA2, hardly_raised, resting_at, two_levers

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_search.next_rest import next_rests
from jointscope.graphs.rest_search.rest_candidates import candidate_rows
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.graphs.starts.spring_knots import with_knots
from jointscope.robots.files.effect_editing import add_effect, remove_effect
from jointscope.tools.presentation.next_rest_text import next_rest_sentence
from jointscope.tools.terminal.rests_text import rest_calibration_text


@pytest.fixture(scope="module")
def levers(tmp_path_factory):
    """Two rods of which the lower one was hardly raised, what they tell, and what they should do next."""
    robot, rests = two_levers(tmp_path_factory.mktemp("two")), hardly_raised(1, 6)
    result = calibrate_rests(robot, [rests])
    return robot, rests, result, next_rests(result)


def found_in(result, name):
    return next(p for p in (*result.parameters, *result.derived) if p.name == name)


def with_rest(robot, rests, advised, seed):
    q = np.array([[advised.posture[joint] for joint in robot.joints]])
    return calibrate_rests(robot, [rests, resting_at(q, seed)])


def test_a_weight_that_is_hardly_felt_is_to_be_lifted(levers):
    robot, _, result, advice = levers
    (beta,) = (a for a in advice if a.name == "gravity.beta2")
    assert beta.share == pytest.approx(
        found_in(result, "gravity.beta2").sigma / found_in(result, "gravity.beta2").value
    )
    assert beta.share > 0.05 > beta.after > beta.after_ten
    lifted = abs(np.sin(beta.posture["a"] + beta.posture["b"]))
    assert lifted > 0.9 and "b" in beta.matters
    said = next_rest_sentence(beta, robot)
    assert said.startswith(f"gravity.beta2 (+-{100 * beta.share:.2g} %)")
    assert ": add a rest with " in said and " deg" in said
    assert said in rest_calibration_text(result, advice=advice)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["gravity.beta2", "b.stiffness"])
def test_the_advised_rest_tells_what_was_promised(levers, kind):
    robot, rests, result, advice = levers
    advised = next(a for a in advice if a.name == kind)
    after = found_in(with_rest(robot, rests, advised, 50), kind)
    before = found_in(result, kind)
    assert after.sigma / before.sigma == pytest.approx(advised.after / advised.share, rel=0.35)
    assert after.sigma < 0.5 * before.sigma
    truth = {"gravity.beta2": BETA2, "b.stiffness": 25.0}[kind]
    assert abs(after.value - truth) < 3.0 * after.sigma
    # another rest where the others are tells little
    usual = resting_at(np.median(rests.q_link, axis=0)[None], 51)
    assert found_in(calibrate_rests(robot, [rests, usual]), kind).sigma > 2.0 * after.sigma


def swung(q, pull, seed):
    """One more rest of the lever, by hand."""
    rng, like = np.random.default_rng(seed), hanging(1, seed)
    tau = -2.0 * 9.81 * 0.3 * np.sin(q) - pull * 0.5 * np.cos(q)
    d = brentq(lambda d: K * d + K2 * d**2 + K3 * d**3 - tau, -0.5, 0.5)
    u = -tau + (C0 + C1 * abs(tau)) * rng.uniform(-1.0, 1.0)
    columns = {"q_motor": q - d, "q_link": q + 2e-4 * rng.normal(), "u": u}
    return replace(
        like, **{k: np.array([[v]]) for k, v in columns.items()}, forces=np.array([[pull, 0.0, 0.0]]), links=("hook",)
    )


@pytest.mark.slow
def test_friction_comes_out_as_well_as_promised_on_the_average(tmp_path):
    robot, ratios = lever(tmp_path), []
    for seed in (3, 5):
        rests = hanging(14, seed)
        result = calibrate_rests(robot, [rests])
        for advised in next_rests(result):
            before, pull = found_in(result, advised.name), float(advised.force[0])
            for other in range(2):
                more = swung(advised.posture["swing"], pull, 100 + other)
                after = found_in(calibrate_rests(robot, [rests, more]), advised.name)
                ratios.append(after.sigma / before.value / advised.after)
    assert len(ratios) >= 6 and np.mean(ratios) == pytest.approx(1.0, abs=0.15)


def test_nothing_is_advised_where_all_is_known_and_where_nothing_helps(tmp_path, levers):
    result = levers[2]
    known = tuple(replace(p, sigma=0.01 * abs(p.value)) for p in result.parameters)
    derived = tuple(replace(p, sigma=0.01 * abs(p.value)) for p in result.derived)
    assert next_rests(replace(result, parameters=known, derived=derived)) == ()
    # a damping acts in motion alone
    useless = replace(known[0], name="a.damping", value=0.1, sigma=0.1)
    assert next_rests(replace(result, parameters=(*known, useless), derived=derived)) == ()


def test_postures_keep_to_limits_efforts_and_bent_springs(tmp_path):
    robot, rests = lever(tmp_path), hanging(14, 5)
    result = calibrate_rests(robot, [rests])
    had = np.abs(rests.q_link - rests.q_motor).max()
    for advised in next_rests(result):
        q, pull = advised.posture["swing"], float(advised.force[0])
        assert abs(q) <= 3.0 and pull in rests.forces[:, 0]
        tau = -2.0 * 9.81 * 0.3 * np.sin(q) - pull * 0.5 * np.cos(q)
        d = brentq(lambda d, tau=tau: K * d + K2 * d**2 + K3 * d**3 - tau, -0.5, 0.5)
        assert abs(d) < 1.15 * had
        assert advised.to_json()["load"]["link"] == "hook" if pull else advised.to_json()["load"] is None


@pytest.mark.parametrize("label", ["spring_pieces_2@swing", "spring_limit@swing"])
def test_springs_of_pieces_and_with_strings_are_not_bent_farther_than_they_were(tmp_path, label):
    bare = remove_effect(lever(tmp_path), "spring_curve@swing")
    rests = hanging(14, 5)
    small = rests.only(np.abs(rests.q_link - rests.q_motor)[:, 0] < 0.1)
    assert 4 < len(small) < len(rests)
    robot = with_knots(add_effect(bare, label), [small])
    tried = np.linspace(-1.5, 1.5, 13)[:, None]
    seen, counts = RestSet.of(robot, small), []
    states = seen.start(Calibration.of(robot))[0]
    for each in (robot, bare):
        whole = RestSet.of(each, small)
        calibration = Calibration.of(each).only([DYNAMICS])
        known = np.eye(len(calibration.names)) * 1e-4
        pulls = np.tile([12.0, 0.0, 0.0], (13, 1))
        rows = candidate_rows(whole, calibration, known, states, tried, pulls, ("hook",) * 13)
        counts.append(np.count_nonzero(np.any(rows != 0.0, axis=(1, 2))))
    assert counts[0] < counts[1]
