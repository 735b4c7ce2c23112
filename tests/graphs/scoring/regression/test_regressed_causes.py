# SPDX-License-Identifier: BSD-3-Clause
"""What a rigid joint lacks has its right name, at its joint; nothing is named where nothing is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import SHARP, Arm, assert_right, moved, robot_file

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.scoring.regression.changed_load import changed_load
from jointscope.graphs.scoring.regression.joint_regression import joint_rows
from jointscope.graphs.scoring.regression.load_friction import load_frictions
from jointscope.graphs.scoring.regression.regressed_causes import regressed_causes
from jointscope.robots.files.effects_at_once import add_effects
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.parts.position_target import PositionTarget
from jointscope.robots.recordings.recording import Recording

ARM = Arm()
HOW = {"seconds": 10.0, "encoder_rate": 250.0, "command_rate": 250.0}
CLEAN = [
    {},
    {"seed": 2},
    {"seed": 3, "noise": 3e-4},
    {"sticks": True},
    {"pause": 0.3},
    {"encoder_rate": 100.0, "command_rate": 100.0},
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return load_robot(robot_file(ARM, tmp_path_factory.mktemp("arm")))


def recording(**how):
    encoder, command = moved(ARM, **{**HOW, **how})
    return Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})


def offset(_, u, __, ___):
    return u + np.array([0.0, 0.4, 0.0])


def unlike_both_ways(_, u, __, data):
    return u - np.array([0.5, 0.0, 0.0]) * np.tanh(SHARP * data.qvel) ** 2


def dead_band(_, u, __, ___):
    return np.sign(u) * np.maximum(np.abs(u) - np.array([0.0, 0.25, 0.0]), 0.0)


def drag(_, u, __, data):
    return u - np.array([0.0, 0.3, 0.0]) * data.qvel * np.abs(data.qvel)


def more_at_rest(_, u, __, data):
    return u - np.array([0.0, 0.8, 0.0]) * np.exp(-((data.qvel / 0.3) ** 2)) * np.tanh(SHARP * data.qvel)


def ripple(_, u, __, data):
    return u + np.array([0.3, 0.15, 0.06]) * np.sin(11.0 * data.qpos)


def growing(share):
    def drive(_, u, __, data):
        return u - share * np.abs(u - data.qfrc_bias) * np.tanh(SHARP * data.qvel)

    return drive


def taken_up_at(moment, kilograms):
    def drive(t, u, model, __):
        if t >= moment and model.body_mass[-1] < taken_up_at.before + 0.5 * kilograms:
            model.body_mass[-1] += kilograms
        return u

    taken_up_at.before = 3.0 * 0.6**2
    return drive


@pytest.mark.parametrize("how", CLEAN, ids=str)
def test_nothing_is_named_where_nothing_is_missing(robot, how):
    rows = joint_rows(robot, [recording(**how)])
    assert load_frictions(rows) == ()
    assert changed_load(rows, ["here"]) is None
    assert [cause for cause in regressed_causes(rows) if cause.size > 0.01] == []


@pytest.mark.parametrize(
    "drive, label, look_alike",
    [
        (offset, "torque_offset@j1", "asymmetric_friction"),
        (unlike_both_ways, "asymmetric_friction@j0", "torque_offset"),
        (dead_band, "pwm_deadband@j1", "truncated_command"),
        (drag, "quadratic_damping@j1", ""),
        (more_at_rest, "motor_stribeck@j1", ""),
    ],
)
def test_what_one_joint_lacks_has_its_name_at_that_joint(robot, drive, label, look_alike):
    (cause,) = regressed_causes(joint_rows(robot, [recording(drive=drive)]))
    assert cause.label == label and set(cause.alike) <= {look_alike}
    assert cause.explained > 0.8 and cause.size > 0.01


def test_drag_that_is_named_is_found_with_its_size_and_all_else_is_right(robot):
    with_it = add_effects(robot, ["quadratic_damping@j1"]).robot
    result = calibrate(with_it, [recording(drive=drag)])
    assert_right(ARM, result.parameters, rel=0.01)
    table = {p.name: p.value for p in result.parameters}
    assert table["j1.quadratic_damping.coefficient"] == pytest.approx(0.3, rel=0.02)
    assert result.asked.causes == () and result.asked.gains == ()


def test_a_defect_of_the_regression_is_not_named_where_the_calibration_does_not_need_it(robot):
    coarse = recording(counts=8192)
    rows = joint_rows(robot, [coarse])
    assert regressed_causes(rows), "joints turn over within a count, which looks like Stribeck friction"
    result = calibrate(robot, [coarse])
    assert result.asked.causes == () and result.asked.changed is None and result.asked.load_frictions == ()


def test_cables_are_springs_at_all_joints(robot):
    causes = regressed_causes(joint_rows(robot, [recording(cable=3.0)]))
    assert [cause.label for cause in causes] == [f"parallel_spring@{joint}" for joint in ARM.joints]


def test_torque_that_repeats_with_the_position_is_a_ripple_with_its_order(robot):
    causes = regressed_causes(joint_rows(robot, [recording(drive=ripple)]))
    assert [cause.label for cause in causes] == [f"cogging@{joint}" for joint in ARM.joints]
    assert [cause.shapes["order"] for cause in causes] == pytest.approx([11.0] * 3, abs=1.0)


def test_friction_that_grows_with_torque_is_told_with_its_share(robot):
    found = load_frictions(joint_rows(robot, [recording(drive=growing(0.06))]))
    assert found
    for one in found:
        assert one.share == pytest.approx(0.06, abs=max(3.0 * one.sigma, 0.006))


def test_a_load_that_is_taken_up_is_told_with_its_time(robot):
    found = changed_load(joint_rows(robot, [recording(drive=taken_up_at(4.3, 0.6))]), ["here"])
    assert found.start == pytest.approx(4.3, abs=0.05) and found.stop == found.end and found.push == 0.0
    assert found.size > 0.02


def test_a_load_that_is_taken_up_and_set_down_is_told_with_both_times(robot):
    def carried(t, u, model, _):
        model.body_mass[-1] = 3.0 * 0.6**2 + (0.6 if 3.1 <= t < 6.7 else 0.0)
        return u

    found = changed_load(joint_rows(robot, [recording(drive=carried)]), ["here"])
    assert (found.start, found.stop) == pytest.approx((3.1, 6.7), abs=0.05) and found.push == 0.0


@pytest.mark.parametrize(
    ("push", "torque"), [((4.0, 4.8, 1, 6.0), 6.0), ((5.5, 99.0, 0, -4.0), -4.0), ((-1.0, 3.3, 2, 1.5), 1.5)]
)
def test_what_pushes_from_outside_is_no_load_and_is_told_with_its_torque(robot, push, torque):
    found = changed_load(joint_rows(robot, [recording(push=push)]), ["here"])
    assert found.joint == f"j{push[2]}" and found.push == pytest.approx(torque, rel=0.05)
    ends = max(push[0], 0.0), min(push[1], found.end)
    assert (found.start, found.stop) == pytest.approx(ends, abs=0.05)


def test_a_push_is_told_with_coarse_encoders(robot):
    coarse = {"counts": 4096, "encoder_rate": 100.0, "command_rate": 100.0}
    found = changed_load(joint_rows(robot, [recording(push=(4.0, 4.8, 1, 4.0), **coarse)]), ["here"])
    assert found.joint == "j1" and found.push == pytest.approx(4.0, rel=0.1)


def test_a_target_that_is_seen_late_does_not_hide_what_drives_carry(robot):
    encoder = robot.motor_encoder
    target = PositionTarget(
        "marker", replace(encoder.source, names=()), "of_j2", np.zeros(3), None, np.eye(4), "marker", 1e-3
    )
    with_it = add_effects(robot.with_sensors({**robot.sensors, "marker": target}), ["encoder_delay@marker"]).robot
    assert changed_load(joint_rows(with_it, [recording(drive=taken_up_at(4.3, 0.6))]), ["here"]) is not None
