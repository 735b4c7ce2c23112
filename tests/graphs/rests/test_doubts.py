# SPDX-License-Identifier: BSD-3-Clause
"""Rests of a rigid joint whose model of weight, load or friction is wrong: friction is right, or the verdict says why.

Equilibria are worked out by hand (lever_bench.py), commands of wrong models here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, hanging, lever
from scipy.stats import beta, kstest

from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.verdicts.rests.rest_verdict import verdict

WEIGHT = 2.0 * 9.81 * 0.3  # [N m] of the rod and what is on it, where it is level


def rigid(count, seed, load=1.0, mass=1.0, friction=None):
    """Rests of a lever whose file knows neither its mass nor its loads, nor how its friction goes with the angle."""
    rests = hanging(count, seed, rigid=True)
    q = rests.q_motor
    pulled = 0.5 * rests.forces[:, :1] * np.cos(q)
    held = rests.u - WEIGHT * np.sin(q) - pulled
    share = 1.0 if friction is None else friction(q)
    u = mass * WEIGHT * np.sin(q) + pulled + held * share
    return replace(rests, u=u, forces=load * rests.forces)


def friction_of(result):
    (found,) = (p for p in result.parameters if p.name == "swing.coulomb_torque")
    return found


@pytest.mark.parametrize("wrong", ({"load": 1.05}, {"load": 0.9}, {"mass": 1.1}, {"mass": 0.9}))
def test_a_wrong_load_or_mass_is_told_and_leaves_friction_right(tmp_path, wrong):
    result = calibrate_rests(lever(tmp_path, rigid=True), [rigid(60, 21, **wrong)])
    found, said = friction_of(result), verdict(result)
    assert abs(found.value - C0) < 2.5 * found.sigma < 0.25 * C0
    assert said.startswith("No, do not rely on this yet:")
    if result.doubts and "load" in wrong and "goes with loads" not in said:
        assert f"loads are {1.0 / wrong['load']:.2f} of what /load says" in said and "`jointscope diagnose" in said


def test_a_wrong_mass_names_the_link(tmp_path):
    result = calibrate_rests(lever(tmp_path, rigid=True), [rigid(60, 21, mass=0.93)])
    assert "link_mass@swing" in {doubt.label for doubt in result.doubts}
    assert result.to_json()["doubts"][0]["p_value"] < 1e-2


def test_friction_that_goes_with_the_angle_is_no_yes(tmp_path):
    rests = rigid(80, 5, friction=lambda q: 1.0 + 0.7 * np.sin(q))
    said = verdict(calibrate_rests(lever(tmp_path, rigid=True), [rests]))
    assert not said.startswith("Yes") and "friction of swing is not the same at all angles" in said
    assert "nothing in the catalogue holds that" in said


def test_a_motor_that_comes_from_one_side_cannot_tell_weight_from_friction(tmp_path):
    rests = rigid(30, 5)
    held = rests.u - WEIGHT * np.sin(rests.q_motor) - 0.5 * rests.forces[:, :1] * np.cos(rests.q_motor)
    one = replace(rests, u=rests.u - held + C0 * (0.8 + 0.2 * np.abs(held) / C0))
    said = verdict(calibrate_rests(lever(tmp_path, rigid=True), [one]))
    assert said.startswith("No") and "swing held the same way at every rest" in said and "from both sides" in said


@pytest.mark.parametrize("count", (10, 15, 60))
def test_true_models_are_not_doubted(tmp_path, count):
    robot = lever(tmp_path, rigid=True)
    results = [calibrate_rests(robot, [rigid(count, 700 + seed)]) for seed in range(10)]
    assert not any(result.doubts for result in results)
    assert sum(verdict(result).startswith("Yes") for result in results) >= (8 if count == 10 else 10)


def test_few_rests_say_how_many_more(tmp_path):
    result = calibrate_rests(lever(tmp_path, rigid=True), [rigid(4, 3)])
    found = friction_of(result)
    more = int(np.ceil(4 * (found.sigma / found.value / 0.25 - 1.0)))
    assert more > 0 and f"let it rest about {more} time" in verdict(result)


@pytest.mark.slow
@pytest.mark.parametrize("count", (7, 10, 15, 30))
def test_two_sigma_hold_friction_wherever_masses_and_loads_are_a_little_off(tmp_path, count):
    rng, robot, inside = np.random.default_rng(count), lever(tmp_path, rigid=True), []
    for seed in range(80):
        load, mass = 1.0 + 0.02 * rng.normal(), 1.0 + 0.03 * rng.normal()
        found = friction_of(calibrate_rests(robot, [rigid(count, 900 + seed, load=load, mass=mass)]))
        inside.append(abs(found.value - C0) < 2.0 * found.sigma)
    assert 0.88 < np.mean(inside) <= 1.0  # 0.95 expected, 0.024 sigma of the share


def test_by_chance_a_band_around_a_constant_is_narrower_as_the_p_value_says():
    y = np.random.default_rng(1).uniform(-1.0, 1.0, (4000, 9))
    narrower = 0.5 * np.ptp(y, axis=1) / np.abs(y).max(axis=1)
    assert kstest(narrower, beta(8, 1).cdf).pvalue > 0.01


@pytest.mark.parametrize("share", (0.99, 1.01))
def test_loads_off_by_a_percent_are_told_where_links_have_springs_and_encoders(tmp_path, share):
    robot, rests = lever(tmp_path), hanging(60, 1)
    assert not calibrate_rests(robot, [rests]).doubts
    result = calibrate_rests(robot, [replace(rests, forces=share * rests.forces)])
    first = result.doubts[0]
    assert first.label == "load_scale@robot" and 1.0 + first.size == pytest.approx(1.0 / share, abs=0.003)
    said = verdict(result)
    assert said.startswith("No, do not rely on this yet: these rests are far likelier")
    assert f"if loads are {1.0 + first.size:.3f} of what /load says" in said


def test_right_loads_of_springs_are_not_doubted(tmp_path):
    robot = lever(tmp_path)
    for seed in (11, 12, 13, 14):
        assert not calibrate_rests(robot, [hanging(40, seed)]).doubts


def test_friction_that_grows_with_the_load_is_told_where_springs_carry_it(tmp_path):
    path = lever(tmp_path).path
    text = path.read_text(encoding="utf-8").replace(", weight_dependent_friction@swing", "")
    path.write_text(
        "\n".join(line for line in text.splitlines() if "weight_dependent_friction" not in line), encoding="utf-8"
    )
    result = calibrate_rests(load_robot(path), [hanging(60, 1)])
    assert {doubt.label for doubt in result.doubts} == {"load_dependent_friction@swing"}
    assert "friction of swing grows with what it carries" in verdict(result)
