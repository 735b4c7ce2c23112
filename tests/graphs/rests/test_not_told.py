# SPDX-License-Identifier: BSD-3-Clause
"""What rests of a rigid joint cannot tell is said by the verdict, and gains have the sigma that masses and loads leave.

Equilibria are worked out by hand (lever_bench.py), commands of wrong models here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, hanging, lever

from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.verdicts.rests.rest_verdict import verdict

WEIGHT = 2.0 * 9.81 * 0.3  # [N m] of the rod and what is on it, where it is level
GAIN = 2.0  # [N m/A]


def with_gain(folder, start=2.1, sigma=0.5, level=True):
    """The rigid lever with a drive in amperes whose constant is asked; it stands upright where it carries no weight."""
    path = lever(folder, rigid=True).path
    text = path.read_text(encoding="utf-8").replace("field: effort, unit: N m}", "field: effort, unit: A}")
    gain = f"parameters:\n  swing.torque_constant: {{value: {start}, unit: N m/A, prior_sigma: {sigma}}}\n"
    text = text.replace("parameters:\n", gain, 1)
    path.write_text(text if level else text.replace("[0.0, 0.0, -9.81]", "[0.0, -9.81, 0.0]"), encoding="utf-8")
    return load_robot(path)


def in_amperes(count, seed, load=1.0, mass=1.0):
    rests = hanging(count, seed, rigid=True)
    u = (rests.u + (mass - 1.0) * WEIGHT * np.sin(rests.q_motor)) / GAIN
    return replace(rests, u=u, forces=load * rests.forces)


def constant_of(result):
    (found,) = (p for p in result.parameters if p.name == "swing.torque_constant")
    return found


def test_joints_that_stood_all_the_time_are_told_with_what_to_do(tmp_path):
    robot, rests = lever(tmp_path, rigid=True), hanging(40, 3, rigid=True)
    result = calibrate_rests(robot, [replace(rests, moved=np.zeros((40, 1), dtype=bool))])
    said = verdict(result)
    assert said.startswith(
        "No, do not rely on this yet: these rests determine no value; swing never moved before any of these"
    )
    assert "say nothing about friction there" in said and "from above and from below" in said and not result.doubts
    springs = lever(tmp_path)
    stood = replace(hanging(60, 1), moved=np.zeros((60, 1), dtype=bool))
    said = verdict(calibrate_rests(springs, [stood]))
    assert said.startswith("Usable, with reservations: swing never moved")
    assert verdict(calibrate_rests(springs, [hanging(60, 1)])).startswith("Yes, the model holds at these rests")


def test_few_rests_from_one_side_are_no_yes_though_nothing_contradicts_them(tmp_path):
    rests = hanging(8, 5, rigid=True)
    held = rests.u - WEIGHT * np.sin(rests.q_motor) - 0.5 * rests.forces[:, :1] * np.cos(rests.q_motor)
    one = replace(rests, u=rests.u - held + np.abs(held))
    result = calibrate_rests(lever(tmp_path, rigid=True), [one])
    assert not result.doubts
    assert not verdict(result).startswith("Yes") and "swing held the same way at every rest: let it" in verdict(result)


@pytest.mark.parametrize("wrong", ({}, {"load": 1.1}, {"load": 0.9}, {"mass": 1.1}))
def test_gains_have_the_sigma_that_loads_and_masses_leave(tmp_path, wrong):
    robot, off = with_gain(tmp_path), []
    for seed in range(50, 54):
        result = calibrate_rests(robot, [in_amperes(40, seed, **wrong)])
        found, said = constant_of(result), verdict(result)
        assert 0.02 * GAIN < found.sigma < 0.06 * GAIN  # loads are 3 % of a scale, masses 10 %
        off.append((found.value - GAIN) / found.sigma if said.startswith("Yes") else 0.0)
        assert not said.startswith("Yes") or "masses and loads: all of these off by one share would not" in said
        assert wrong or (said.startswith("Yes") and not result.doubts)
    assert np.all(np.abs(off) < 2.5)


def test_a_gain_of_a_joint_that_carries_nothing_is_not_told(tmp_path):
    robot = with_gain(tmp_path, start=1.0, sigma=0.2, level=False)
    rests = hanging(60, 8, rigid=True)
    held = rests.u - WEIGHT * np.sin(rests.q_motor) - 0.5 * rests.forces[:, :1] * np.cos(rests.q_motor)
    pulled = 0.005 * 0.5 * rests.forces[:, :1] * np.cos(rests.q_motor)
    result = calibrate_rests(robot, [replace(rests, u=(held + pulled) / 1.1, forces=0.005 * rests.forces)])
    said = verdict(result)
    assert said.startswith("Usable") and "swing.torque_constant cannot be told where a joint carries little" in said
    friction = next(p for p in result.parameters if p.name == "swing.coulomb_torque")
    assert abs(friction.value - C0) < 2.0 * friction.sigma


@pytest.mark.parametrize("count", (10, 40))
def test_an_error_is_noticed_beyond_what_is_said_to_be_unnoticed(tmp_path, count):
    robot, rests = lever(tmp_path, rigid=True), hanging(count, 33, rigid=True)
    clean = calibrate_rests(robot, [rests])
    mass, load = clean.unnoticed
    assert (mass.label, load.label) == ("link_mass@swing", "load_scale@robot")
    assert mass.size == pytest.approx(2.0 * mass.share) and 0.005 < mass.share < 0.6
    assert "the mass of the link of swing" in verdict(clean) or mass.share < 0.1
    assert clean.to_json()["unnoticed"] == {mass.label: mass.share, load.label: load.share}
    more = WEIGHT * np.sin(rests.q_motor)
    labels = [
        {
            doubt.label
            for sign in (-1.0, 1.0)
            for doubt in calibrate_rests(robot, [replace(rests, u=rests.u + sign * times * mass.share * more)]).doubts
        }
        for times in (0.3, 3.0)
    ]
    assert not labels[0] and "link_mass@swing" in labels[1]


def test_without_weights_nothing_is_said_of_loads(tmp_path):
    rests = hanging(40, 3, rigid=True)
    free = rests.u - 0.5 * rests.forces[:, :1] * np.cos(rests.q_motor)
    result = calibrate_rests(lever(tmp_path, rigid=True), [replace(rests, u=free, forces=0.0 * rests.forces)])
    assert [each.label for each in result.unnoticed] == ["link_mass@swing"] and "loads by" not in verdict(result)


def test_springs_say_how_far_all_weights_may_be_off_together(tmp_path):
    robot, rests = lever(tmp_path), hanging(60, 1)
    result = calibrate_rests(robot, [rests])
    mass, load, together = result.unnoticed
    assert (mass.label, load.label, together.label) == ("link_mass@swing", "load_scale@robot", "weights@robot")
    assert max(mass.share, load.share) < 0.01 < together.share < 0.1  # a spring tells weights from each other
    assert f"one share of up to {100.0 * together.share:.1f} % would not show" in verdict(result)
    share, path = 0.4 * together.share, robot.tree.urdf
    text = path.read_text(encoding="utf-8").replace('<mass value="2"', f'<mass value="{2.0 * (1.0 + share):.6f}"')
    path.write_text(text, encoding="utf-8")
    heavier = calibrate_rests(load_robot(robot.path), [replace(rests, forces=(1.0 + share) * rests.forces)])
    assert verdict(heavier).startswith("Yes, the model holds at these rests") and share > 0.005
    before, after = (
        next(p for p in each.parameters if p.name == "swing.stiffness").value for each in (result, heavier)
    )
    assert after / before == pytest.approx(1.0 + share, rel=0.002)


def test_rests_that_contradict_as_they_are_hide_nothing_more(tmp_path):
    rests = hanging(60, 1)
    result = calibrate_rests(lever(tmp_path), [replace(rests, forces=1.01 * rests.forces)])
    assert {u.label: u.share for u in result.unnoticed}["load_scale@robot"] == 0.0
