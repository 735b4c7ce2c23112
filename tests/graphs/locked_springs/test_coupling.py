# SPDX-License-Identifier: BSD-3-Clause
"""Locked springs show the matrix between motors and links; its truth comes from lengths of ropes, not from a matrix."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from locked_bench import BIOROB, BIOROB_T, DOGGY, DOGGY_T, LATE, locked_bench, with_matrix

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.locked_springs.coupling import find_coupling
from jointscope.graphs.locked_springs.locked_readings import LockedReadings
from jointscope.graphs.locked_springs.locked_set import ZEROS, LockedSet
from jointscope.robots.dynamics.transmission import Transmission
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.tools.simulator.simulation import simulate

ROBOTS = {"biorob": (BIOROB, BIOROB_T), "doggy": (DOGGY, DOGGY_T)}


def readings(robot, seed=0, joints=None, **more):
    return LockedReadings.of(locked_bench(robot, seed, **more), robot, joints or robot.joints)


@pytest.fixture(scope="module")
def found():
    """Of each robot, a file that knows no coupling, and seven benches."""
    return {
        name: [find_coupling(replace(robot, transmission=None), [readings(robot, seed)]) for seed in range(7)]
        for name, (robot, _) in ROBOTS.items()
    }


@pytest.mark.parametrize("name", ROBOTS)
def test_every_element_is_found_without_a_start_and_within_its_sigma(found, name):
    truth, z = ROBOTS[name][1], []
    for coupling in found[name]:
        for at, value in truth.items():
            assert coupling.sigmas[at] > 0.0
            assert coupling.matrix[at] == pytest.approx(value, abs=5e-4)
            z.append((coupling.matrix[at] - value) / coupling.sigmas[at])
    assert 0.6 < np.std(z) < 1.3 and np.mean(np.abs(z) < 2.0) >= 0.9


@pytest.mark.parametrize("name", ROBOTS)
def test_elements_that_are_no_pulley_are_zero_and_no_others(found, name):
    robot, truth = ROBOTS[name]
    there = np.zeros((robot.n, robot.n), bool)
    for at in truth:
        there[at] = True
    for coupling in found[name]:
        np.testing.assert_array_equal(coupling.matrix != 0.0, there)


@pytest.mark.parametrize("name", ROBOTS)
def test_late_link_encoders_are_found_and_bend_nothing(found, name):
    for coupling in found[name]:
        assert coupling.fits[0].delays[0] == pytest.approx(LATE, abs=2e-4)


def test_ratios_need_not_be_integers_and_a_file_that_is_right_is_left_in_peace():
    coupling = find_coupling(with_matrix(BIOROB, BIOROB_T), [readings(BIOROB)])
    assert coupling.others == [] and coupling.sentence() is None


def test_a_coupling_that_is_missing_is_named_with_the_matrix_to_paste():
    robot = with_matrix(BIOROB, {at: value for at, value in BIOROB_T.items() if at != (3, 2)})
    coupling = find_coupling(robot, [readings(BIOROB)])
    assert coupling.others == [(3, 2)]
    said = coupling.sentence()
    assert said.startswith(
        "bench: the transmission of biorob is not that of its locked springs: joint4.from_joint3 is -0.1"
    )
    assert "(file: 0); write `transmission: {matrix: [[0.322" in said and ", 0, 0, 0], [0, 0.300" in said


def test_names_that_are_exchanged_come_to_mind_where_a_joint_does_not_follow_its_own_motor():
    bench = locked_bench(BIOROB, 4)
    links = bench.streams["link_encoder"]
    exchanged = replace(links, values=links.values[:, [0, 1, 3, 2]])
    recording = replace(bench, streams={**bench.streams, "link_encoder": exchanged})
    joints = tuple(BIOROB.joints)
    said = find_coupling(BIOROB, [LockedReadings.of(recording, BIOROB, joints)]).sentence()
    assert said.endswith("; joint4 not turned by its own motor: check `names` of both encoders first")
    assert "`names`" not in find_coupling(DOGGY, [readings(DOGGY)]).sentence()


def test_one_locked_spring_shows_its_rope_and_leaves_the_others_of_the_file():
    robot = with_matrix(BIOROB, {at: value for at, value in BIOROB_T.items() if at != (3, 2)})
    coupling = find_coupling(robot, [readings(BIOROB, joints=("joint4",))])
    assert coupling.sigmas[0, 0] == 0.0 and coupling.matrix[0, 0] == BIOROB_T[0, 0]
    assert coupling.matrix[3, 2] == pytest.approx(BIOROB_T[3, 2], abs=4.0 * coupling.sigmas[3, 2])


def test_a_spring_that_is_locked_in_two_groups_of_recordings_has_what_the_longer_ones_say():
    plain = replace(BIOROB, transmission=None)
    late = readings(BIOROB, 1, joints=("joint4",), seconds=60.0)
    alone, both = find_coupling(plain, [late]), find_coupling(plain, [readings(BIOROB), late])
    first = find_coupling(plain, [readings(BIOROB)])
    np.testing.assert_allclose(both.matrix[:3, :3], first.matrix[:3, :3])
    # the row of joint 4 in A = T^-1, which the angles of joints 1 to 3 come into when it is turned round
    np.testing.assert_allclose(np.linalg.inv(both.matrix)[3], np.linalg.inv(alone.matrix)[3], atol=1e-12)
    assert both.sigmas[3, 3] == pytest.approx(alone.sigmas[3, 3], rel=1e-6) and both.sigmas[3, 3] < first.sigmas[3, 3]
    for at, value in BIOROB_T.items():
        assert both.matrix[at] == pytest.approx(value, abs=4.0 * both.sigmas[at])
    other = find_coupling(plain, [late, readings(BIOROB)])
    np.testing.assert_array_equal(other.matrix, both.matrix)
    np.testing.assert_array_equal(other.sigmas, both.sigmas)


def test_a_matrix_that_did_not_converge_is_no_result(monkeypatch):
    monkeypatch.setattr("jointscope.graphs.locked_springs.coupling_matrix.ROUNDS", 1)
    monkeypatch.setattr("jointscope.graphs.locked_springs.coupling_matrix.WIDENINGS", 0)
    with pytest.raises(RecordingError, match=r"bench: no matrix between motors and links was found \(no convergence\)"):
        find_coupling(replace(BIOROB, transmission=None), [readings(BIOROB)])


def test_a_wrong_coupling_of_an_effect_stays_one_of_the_effect():
    plain = with_matrix(BIOROB, {at: value for at, value in BIOROB_T.items() if at != (3, 2)})
    robot = replace(
        add_effect(replace(plain, effects=()), "kinematic_coupling@joint4"), transmission=plain.transmission
    )
    coupling = find_coupling(robot, [readings(BIOROB)])
    mended = coupling.of_robot()
    assert mended.values["joint4.kinematic_coupling.from_joint3"] == pytest.approx(coupling.matrix[3, 2])
    assert "joint4.from_joint3" not in mended.parameters
    np.testing.assert_allclose(Transmission(mended, ()).matrix(mended.values), coupling.matrix, atol=1e-12)


def test_elements_become_parameters_but_those_that_the_file_holds():
    coupling = find_coupling(replace(DOGGY, transmission=None), [readings(DOGGY)])
    mended = coupling.of_robot()
    names = {f"joint{i + 1}.from_joint{j + 1}" for i, j in DOGGY_T}
    assert {name for name in mended.parameters if ".from_" in name} == names
    fixed = {
        **mended.parameters,
        "joint1.from_joint1": replace(mended.parameters["joint1.from_joint1"], value=1.9, fixed=True),
    }
    held = find_coupling(replace(mended, parameters=fixed), [readings(DOGGY)])
    assert held.others[0] == (0, 0)  # told, and left
    assert held.of_robot().values["joint1.from_joint1"] == 1.9


@pytest.mark.parametrize("name", ROBOTS)
def test_the_gradient_in_the_graph_is_that_of_the_cost_in_every_coordinate(name):
    robot, truth = ROBOTS[name]
    coupling = find_coupling(replace(robot, transmission=None), [readings(robot, joints=robot.joints[1:])])
    labels = ("encoder_offset@joint2.link", "encoder_eccentricity@joint3")
    model = coupling.of_robot()
    for label in labels:
        model = add_effect(model, label)
    model = replace(model, transmission=coupling.matrix)
    some = {p: 0.02 for p in model.parameters if "encoder_" in p}
    (problem,) = coupling.sets(model.with_values({**some, "joint2.from_joint2": 0.33}))
    problem = replace(problem, widened=np.linspace(1.2, 2.0, len(problem.widened)))
    x, calibration = problem.start(Calibration.of(problem.robot))
    rng = np.random.default_rng(1)
    calibration = calibration.retract({ZEROS: 1e-3 * rng.normal(size=calibration.block_size(ZEROS))})
    system, told = problem.linearize(x, calibration), 0
    for block, place in calibration.columns.items():
        for k in range(place.stop - place.start):
            step = np.zeros(place.stop - place.start)
            step[k] = 1e-6
            there, back = (problem.linearize(x, calibration.retract({block: s * step})).cost for s in (1.0, -1.0))
            slope, size = (there - back) / 2e-6, np.sqrt(system.C[place.start + k, place.start + k] * system.cost)
            assert system.g_p[place.start + k] == pytest.approx(slope, abs=2e-4 * size + 1e-6), (block, k)
            told += bool(size > 0.0)
    assert told > len(truth)


def test_the_graph_agrees_with_the_estimate_of_the_locked_springs_alone():
    coupling = find_coupling(replace(BIOROB, transmission=None), [readings(BIOROB)])
    model = coupling.of_robot()
    (problem,) = coupling.sets(model)
    assert isinstance(problem, LockedSet) and problem.measured == 4 * len(problem.readings)
    x, calibration = problem.start(Calibration.of(model))
    own = [i for i, name in enumerate(calibration.names) if ".from_" in name]
    columns = [calibration.columns[DYNAMICS].start + i for i in own] + [*range(*calibration.columns[ZEROS].indices(99))]
    for _ in range(3):
        system = problem.linearize(x, calibration)
        covariance = np.linalg.inv(system.C[np.ix_(columns, columns)])
        step = np.zeros(calibration.size)
        step[columns] = -covariance @ system.g_p[columns]
        calibration = calibration.retract({block: step[at] for block, at in calibration.columns.items()})
    for k, i in enumerate(own):
        owner, _, other = calibration.names[i].partition(".from_")
        at = BIOROB.joints.index(owner), BIOROB.joints.index(other)
        sigma = np.sqrt(covariance[k, k])
        assert sigma == pytest.approx(coupling.sigmas[at], rel=0.03)
        assert calibration.values[i] == pytest.approx(coupling.matrix[at], abs=0.05 * sigma)


def test_two_recordings_tell_more_than_one():
    one = find_coupling(BIOROB, [readings(BIOROB)])
    both = find_coupling(BIOROB, [readings(BIOROB), readings(BIOROB, 1, path="late")])
    assert both.sigmas[3, 2] < 0.85 * one.sigmas[3, 2]
    assert both.matrix[3, 2] == pytest.approx(BIOROB_T[3, 2], abs=3.5 * both.sigmas[3, 2])


def test_a_spring_that_deflects_is_refused_with_how_far():
    give = 0.24  # [rad/(N m)] a tenth of what the softest spring of the arm gives
    bench = readings(BIOROB, give=give)
    q = bench.q_link
    pulled = BIOROB.tree.torque(q, 0.0 * q, 0.0 * q)[:, 0] * 0.0079 / 0.0245  # joint 1 has no idler on its rope
    with pytest.raises(RecordingError) as err:
        find_coupling(BIOROB, [bench])
    said = str(err.value)
    told = re.match(r"bench: the spring of joint1 is said to be locked, but deflects by (\S+) rad of its motor", said)
    assert float(told[1]) == pytest.approx(give * np.ptp(pulled), rel=0.1)
    assert said.endswith("lock it, or name the others as `locked_springs: [JOINT, ...]` in biorob")


def test_a_clamp_that_gives_way_by_a_little_is_no_spring():
    coupling = find_coupling(BIOROB, [readings(BIOROB, give=0.005)])  # a five hundredth of the softest spring
    for at, value in BIOROB_T.items():
        assert coupling.matrix[at] == pytest.approx(value, abs=2e-3)  # it looks like a coupling, and is as small


def test_a_joint_that_stands_shows_nothing_of_its_rope():
    bench = locked_bench(BIOROB, 0)
    still = {name: replace(s, values=np.where(np.arange(4) == 1, 0.1, s.values)) for name, s in bench.streams.items()}
    with pytest.raises(
        RecordingError, match=r"^bench: joint2 stands still \(joint2 spans 0 rad\) though the spring is said"
    ):
        LockedReadings.of(replace(bench, streams=still), BIOROB, BIOROB.joints)
    kept = LockedReadings.of(replace(bench, streams=still), BIOROB, ("joint1", "joint3", "joint4"))
    coupling = find_coupling(BIOROB, [kept])
    assert coupling.matrix[1, 1] == pytest.approx(BIOROB_T[1, 1]) and coupling.sigmas[1, 1] == 0.0
    assert coupling.matrix[3, 2] == pytest.approx(BIOROB_T[3, 2], abs=4.0 * coupling.sigmas[3, 2])


def test_hardly_any_motion_and_no_encoders_on_the_links_are_refused():
    bench = locked_bench(BIOROB, 0, seconds=0.4)
    with pytest.raises(RecordingError, match=r"read something new \d+ times; expected 50 for the matrix"):
        LockedReadings.of(bench, BIOROB, BIOROB.joints)
    blind = replace(BIOROB, sensors={"motor_encoder": BIOROB.motor_encoder})
    with pytest.raises(RecordingError, match="no sensor of kind link_encoder; add one, or leave the recording out"):
        LockedReadings.of(bench, blind, BIOROB.joints)


@pytest.mark.slow
def test_motion_and_locked_springs_share_the_elements_in_one_graph():
    pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")
    belts = {(0, 0): 1.0, (1, 1): 1.0, (2, 1): 0.3, (2, 2): 0.9}  # the belt of joint 3 runs over the axis of joint 2
    truth = with_matrix(DOGGY, belts)
    motion = simulate(truth, "calibration", 3.0, seed=3, friction="smooth").recording
    bench = locked_bench(
        DOGGY, 0, ropes=lambda q: np.stack([q[:, 0], q[:, 1], (q[:, 2] - 0.3 * q[:, 1]) / 0.9], axis=1)
    )
    coupling = find_coupling(replace(DOGGY, transmission=None), [LockedReadings.of(bench, DOGGY, DOGGY.joints)])
    model = coupling.of_robot()
    alone, both = calibrate(model, [motion]), calibrate(model, [motion], sets=coupling.sets(model))
    for (i, j), value in belts.items():
        name = coupling.element(i, j)
        without, found = (next(p for p in result.parameters if p.name == name) for result in (alone, both))
        widened = both.sigma_inflation.get(name, 1.0), alone.sigma_inflation.get(name, 1.0)
        assert found.value == pytest.approx(value, abs=3.5 * found.sigma)
        # never worse than the better of the two by itself
        assert found.sigma / widened[0] < 1.05 * min(without.sigma / widened[1], coupling.sigmas[i, j])
    assert both.samples == alone.samples + 3 * len(coupling.fits[0].readings[0])
