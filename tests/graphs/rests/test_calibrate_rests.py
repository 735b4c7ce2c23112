# SPDX-License-Identifier: BSD-3-Clause
"""Springs, friction and gravity from rests of an arm of one joint, whose equilibria are worked out here by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, C1, K2, K3, K, hanging, lever

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.rest_sets.rest_errors import rest_errors
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.graphs.rests.calibrate_rests import calibrate_rests, check_bands
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.verdicts.rests.rest_verdict import verdict


def test_spring_curve_and_friction_band_come_out_with_sigmas_that_hold(tmp_path):
    robot = lever(tmp_path)
    result = calibrate_rests(robot, [hanging(60, 1)])
    found = {p.name: p for p in result.parameters}
    truth = {
        "swing.stiffness": K, "swing.spring_curve.quadratic": K2, "swing.spring_curve.cubic": K3,
        "swing.coulomb_torque": C0, "swing.weight_dependent_friction.coefficient": C1,
    }  # fmt: skip
    assert set(found) == set(truth)
    assert set(result.silent) == {"swing.inertia", "swing.damping"}
    for name, value in truth.items():
        assert abs(found[name].value - value) < 3.0 * found[name].sigma, name
    assert found["swing.stiffness"].sigma < 0.01 * K and found["swing.coulomb_torque"].sigma < 0.1 * C0
    assert 0.7 < result.errors.error < 1.3 < result.before.error
    held_out = rest_errors([RestSet.of(result.robot, hanging(40, 2))])
    exact = rest_errors([RestSet.of(robot.with_values(truth), hanging(40, 2))])
    assert held_out.error < 1.05 * exact.error


DERIVED = """derived:
  spring: {unit: N m/rad, of: {swing.stiffness: 2.0}}
  friction.c0: {unit: N m, of: {swing.coulomb_torque: 1.0}}
  friction.c1: {unit: '1', of: {swing.weight_dependent_friction.coefficient: 0.5}}
"""


def test_a_result_that_is_a_value_in_other_words_has_its_sigma(tmp_path):
    path = lever(tmp_path).path
    viscous = "  swing.motor_viscous.coefficient: {value: 0.3, unit: N m s/rad, prior_sigma: 1.0}\n"
    viscous += "effects: [motor_viscous@swing, "
    path.write_text(path.read_text(encoding="utf-8").replace("effects: [", viscous, 1) + DERIVED, encoding="utf-8")
    result = calibrate_rests(load_robot(path), [hanging(60, 1)])  # viscous friction is held, being none of rests
    found, derived = ({p.name: p for p in part} for part in (result.parameters, result.derived))
    for name, of, factor in (
        ("spring", "swing.stiffness", 2.0),
        ("friction.c0", "swing.coulomb_torque", 1.0),
        ("friction.c1", "swing.weight_dependent_friction.coefficient", 0.5),
    ):
        assert derived[name].value == pytest.approx(factor * found[of].value, rel=1e-9)
        assert derived[name].sigma == pytest.approx(factor * found[of].sigma, rel=1e-6)


def test_motors_that_creep_tell_their_friction_better_than_those_that_stand(tmp_path):
    robot = lever(tmp_path)
    stands, creeps = (calibrate_rests(robot, [hanging(40, 5, creeping=n)]) for n in (0, 30))
    before, after = ({p.name: p for p in result.parameters} for result in (stands, creeps))
    for name, value in {"swing.coulomb_torque": C0, "swing.weight_dependent_friction.coefficient": C1}.items():
        assert abs(after[name].value - value) < 3.0 * after[name].sigma, name
        assert after[name].sigma < 0.5 * before[name].sigma, name
    assert after["swing.coulomb_torque"].value == pytest.approx(C0, rel=0.02)
    assert abs(after["swing.stiffness"].value - K) < 3.0 * after["swing.stiffness"].sigma


@pytest.mark.parametrize("start", (1.0, 2.2, 3.0))
def test_a_drive_gain_is_found_from_starts_that_are_far_off(tmp_path, start):
    # from 3.0 bands first become so wide that nothing leads back: then links find their springs before them
    path = lever(tmp_path).path
    text = path.read_text(encoding="utf-8").replace("field: effort, unit: N m}", "field: effort, unit: A}")
    gain = f"parameters:\n  swing.torque_constant: {{value: {start}, unit: N m/A, prior_sigma: 3.0}}\n"
    path.write_text(text.replace("parameters:\n", gain, 1), encoding="utf-8")
    rests = hanging(60, 1)
    result = calibrate_rests(load_robot(path), [replace(rests, u=rests.u / 2.0)])
    found = {p.name: p for p in result.parameters}
    assert abs(found["swing.torque_constant"].value - 2.0) < 3.0 * found["swing.torque_constant"].sigma < 0.1
    assert abs(found["swing.coulomb_torque"].value - C0) < 3.0 * found["swing.coulomb_torque"].sigma < 0.5 * C0


def test_friction_that_ran_away_is_no_result(tmp_path):
    far = lever(tmp_path).with_values({"swing.coulomb_torque": 300.0})
    whole = RestSet.of(far, hanging(20, 1))
    x, calibration = whole.start(Calibration.of(far))
    with pytest.raises(SolveError, match=r"friction of swing ran away: it could hold 3\d\d N m"):
        check_bands(whole, x, calibration)


def test_friction_far_beyond_its_band_and_sigmas_that_were_widened_are_no_yes(tmp_path):
    good = calibrate_rests(lever(tmp_path), [hanging(60, 1)])
    assert verdict(good).startswith("Yes")
    narrow = good.robot.with_values({"swing.coulomb_torque": 0.1, "swing.weight_dependent_friction.coefficient": 0.01})
    said = verdict(replace(good, errors=rest_errors([p.of_robot(narrow) for p in good.problems])))
    assert said.startswith("No") and "friction of swing would have to hold" in said and "diagnose" in said
    wide = tuple(replace(p, repeatability=np.array([20.0])) for p in good.problems)
    assert "swing rests 20 sigmas of its encoder away" in verdict(replace(good, problems=wide))


def test_rests_too_few_to_tell_the_spring_are_no_yes(tmp_path):
    robot = lever(tmp_path)
    assert verdict(calibrate_rests(robot, [hanging(60, 1)])).startswith("Yes")
    few = calibrate_rests(robot, [hanging(4, 1)])
    assert "4 rests for 5 values of swing; nothing could contradict them" in verdict(few)
    assert verdict(replace(few, parameters=())).startswith("Yes")  # nothing was asked of them
    share = {"swing.stiffness": 0.5, "swing.coulomb_torque": 0.1}
    loose = tuple(replace(p, sigma=share.get(p.name, 0.0) * p.value) for p in few.parameters)
    said = verdict(replace(few, parameters=loose, problems=few.problems * 2))
    assert said.startswith("Usable") and "these rests hardly determine swing.stiffness (+-50 %);" in said


def test_gradients_are_those_of_differences(tmp_path):
    robot = lever(tmp_path)
    problem = RestSet.of(robot, hanging(6, 3, creeping=2))
    x, calibration = problem.start(Calibration.of(robot))
    x, h = x + 1e-3, 1e-7
    system = problem.linearize(x, calibration)
    for i in range(x.shape[1]):
        step = h * np.eye(x.shape[1])[i]
        costs = [problem.linearize(x + side * step, calibration).costs for side in (1.0, -1.0)]
        np.testing.assert_allclose(system.g_x[:, i], (costs[0] - costs[1]) / (2.0 * h), rtol=1e-4, atol=1e-2)
    for i, name in enumerate(calibration.names):
        step = h * np.eye(len(calibration.names))[i]
        there = [calibration.with_points({DYNAMICS: calibration.dynamics + side * step}) for side in (1.0, -1.0)]
        up, down = (problem.linearize(x, point).cost for point in there)
        assert system.g_p[i] == pytest.approx((up - down) / (2.0 * h), rel=1e-4, abs=0.1), name


def test_a_motor_that_has_not_moved_says_nothing_of_its_band(tmp_path):
    robot = lever(tmp_path)
    rests = hanging(30, 4)
    result = calibrate_rests(robot, [replace(rests, moved=np.zeros((30, 1), dtype=bool))])
    assert "swing.coulomb_torque" in result.silent
    assert {p.name for p in result.parameters} >= {"swing.stiffness"}


def test_rests_of_a_rigid_joint_tell_its_friction(tmp_path):
    robot = lever(tmp_path, rigid=True)
    result = calibrate_rests(robot, [hanging(80, 5, rigid=True)])
    (found,) = result.parameters
    assert found.name == "swing.coulomb_torque" and abs(found.value - C0) < 3.0 * found.sigma < 0.1 * C0


def test_rigid_joints_that_creep_carry_their_weight(tmp_path):
    robot = lever(tmp_path, rigid=True)
    result = calibrate_rests(robot, [hanging(40, 6, rigid=True, creeping=30)])
    (found,) = result.parameters
    assert found.value == pytest.approx(C0, rel=0.01) and abs(found.value - C0) < 3.0 * found.sigma


def test_less_torque_per_command_is_no_likelier_where_commands_are_judged(tmp_path):
    robot = add_effect(lever(tmp_path), "torque_constant_error@swing", {"share": 0.0})
    # commands that friction alone holds: half of their torque fits into half of the band
    rests = replace(hanging(30, 8), forces=np.zeros((30, 3)), q_motor=np.zeros((30, 1)), q_link=np.zeros((30, 1)))
    rests = replace(rests, u=np.linspace(-0.3, 0.3, 30)[:, None])
    costs = {}
    for per_command in (False, True):
        for share in (0.0, -0.5):
            values = {"swing.torque_constant_error.share": share, "swing.coulomb_torque": 0.31 * (1.0 + share)}
            values["swing.weight_dependent_friction.coefficient"] = 1e-9
            problem = replace(RestSet.of(robot, rests).of_robot(robot.with_values(values)), per_command=per_command)
            x, calibration = problem.start(Calibration.of(problem.robot))
            costs[per_command, share] = problem.linearize(x, calibration).cost
    assert costs[False, -0.5] < costs[False, 0.0] - 0.9 * 30 * np.log(2.0)
    assert costs[True, -0.5] == pytest.approx(costs[True, 0.0], abs=0.1 * 30)


def test_recordings_as_one_set_cost_what_they_cost_one_by_one(tmp_path):
    robot = lever(tmp_path)
    problems = [RestSet.of(robot, hanging(count, count, creeping=2)) for count in (6, 9)]
    starts = [problem.start(Calibration.of(robot)) for problem in problems]
    whole = RestSet.joined(problems)
    x, calibration = whole.start(Calibration.of(robot))
    together = whole.linearize(x, calibration)
    apart = [problem.linearize(*start) for problem, start in zip(problems, starts, strict=True)]
    np.testing.assert_allclose(together.costs, np.concatenate([each.costs for each in apart]))
    np.testing.assert_allclose(together.g_p, sum(each.g_p for each in apart))
    kept = np.arange(15) >= 6
    np.testing.assert_allclose(whole.only(kept).linearize(x[kept], calibration).costs, apart[1].costs)


@pytest.mark.parametrize(
    ("label", "start"),
    [
        ("encoder_offset@swing", {"offset": 0.01}),
        ("encoder_offset@swing.link", {"offset": -0.02}),
        ("encoder_eccentricity@swing.link", {"cos": 0.01, "sin": 0.02, "cos2": 0.005, "sin2": -0.01}),
        ("encoder_scale@swing", {"scale": 0.02}),
        ("torque_constant_error@swing", {"share": 0.1}),
        ("pwm_deadband@swing", {"width": 0.3}),
    ],
)
def test_effects_of_encoders_and_commands_act_at_rest_with_the_gradients_of_differences(tmp_path, label, start):
    robot = add_effect(lever(tmp_path), label, start)
    problem = replace(RestSet.of(robot, hanging(8, 3, creeping=3)), per_command=True)
    x, calibration = problem.start(Calibration.of(robot))
    system, h = problem.linearize(x + 1e-3, calibration), 1e-7
    plain = RestSet.of(lever(tmp_path), hanging(8, 3, creeping=3))
    assert system.cost != pytest.approx(plain.linearize(x + 1e-3, Calibration.of(plain.robot).only([DYNAMICS])).cost)
    for i, name in enumerate(calibration.names):
        step = h * np.eye(len(calibration.names))[i]
        there = [calibration.with_points({DYNAMICS: calibration.dynamics + side * step}) for side in (1.0, -1.0)]
        up, down = (problem.linearize(x + 1e-3, point).cost for point in there)
        assert system.g_p[i] == pytest.approx((up - down) / (2.0 * h), rel=1e-4, abs=0.2), name
