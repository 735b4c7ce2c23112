# SPDX-License-Identifier: BSD-3-Clause
"""Coarse encoders, slow recordings, wrong sigmas and measured drives on a pendulum that is integrated here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slow_pendulum import TRUTH, pendulum, recorded, swing

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_writer import robot_text
from jointscope.tools.verdicts.judgement import judge
from jointscope.tools.verdicts.priors.held_values import values_from_data

STEP = 2.0 * np.pi / 4096.0


@pytest.fixture(scope="module")
def held():
    """Five seconds at 100 Hz."""
    return swing(5.0, 100.0)


def counted(found, step=STEP):
    stamps, currents, angles = found
    return recorded(stamps, currents, step * np.rint(angles / step))


def noisy(found, sigma):
    stamps, currents, angles = found
    return recorded(stamps, currents, angles + np.random.default_rng(2).normal(0.0, sigma, angles.shape))


def is_right(result):
    found = {p.name: p for p in result.parameters}
    return all(
        abs(found[name].value - value) < max(3.5 * found[name].sigma, 0.002 * value)
        and found[name].sigma < 0.05 * value
        for name, value in TRUTH.items()
    )


def test_4096_counts_a_turn_at_100_hz_are_enough(tmp_path, held):
    result = calibrate(pendulum(tmp_path, STEP / np.sqrt(12.0)), [counted(held)])
    assert is_right(result)
    assert judge(result).level in ("good", "warn")


@pytest.mark.parametrize("factor", [0.4, 2.4, 8.0])
def test_a_wrong_sigma_is_found_anew_and_written(tmp_path, held, factor):
    true = 1e-4
    result = calibrate(pendulum(tmp_path, factor * true), [noisy(held, true)])
    assert is_right(result)
    assert judge(result).level == "good"
    assert result.robot.motor_encoder.sigmas == pytest.approx([true], rel=0.15)
    assert result.channels["swing.motor_position"].sigma == result.robot.motor_encoder.sigmas[0]
    assert any("`estimate_sigma: false` in sensors.enc keeps yours" in said for said in result.findings)
    written = tmp_path / "out.yaml"
    written.write_text(robot_text(result.robot, tmp_path), encoding="utf-8")
    from jointscope.robots.files.robot_file import load_robot

    np.testing.assert_allclose(load_robot(written).motor_encoder.sigmas, result.robot.motor_encoder.sigmas, rtol=1e-2)


def test_a_right_sigma_stays_to_the_digit(tmp_path, held):
    robot = pendulum(tmp_path, 1e-4)
    result = calibrate(robot, [noisy(held, 1e-4)])
    np.testing.assert_array_equal(result.robot.motor_encoder.sigmas, robot.motor_encoder.sigmas)
    assert not any("estimate_sigma" in said for said in result.findings)


def test_a_sigma_that_the_user_keeps_is_no_reason_for_no(tmp_path, held):
    robot = pendulum(tmp_path, 4e-4, keep=", estimate_sigma: false")
    result = calibrate(robot, [noisy(held, 1e-4)])
    np.testing.assert_array_equal(result.robot.motor_encoder.sigmas, robot.motor_encoder.sigmas)
    assert result.channels["swing.motor_position"].chi2 < 0.2
    assert is_right(result)
    assert judge(result).level in ("good", "warn")


@pytest.mark.parametrize("keep", ["", ", estimate_sigma: false"])
def test_neither_a_sigma_nor_a_torque_that_lasts_hides_a_missing_effect(tmp_path, held, keep):
    """Without its viscous friction the model is wrong, and the encoder is not to blame."""
    robot = pendulum(tmp_path, 1e-4, keep=keep)
    text = (tmp_path / "pendulum.yaml").read_text(encoding="utf-8")
    kept = text.replace("effects: [motor_viscous@swing]", "")
    start = kept.index("  swing.motor_viscous")
    (tmp_path / "without.yaml").write_text(kept[:start] + kept[kept.index("noise:") :], encoding="utf-8")
    from jointscope.robots.files.robot_file import load_robot

    robot = load_robot(tmp_path / "without.yaml")
    result = calibrate(robot, [noisy(held, 1e-4)])
    assert result.robot.motor_encoder.sigmas[0] < 1.3e-4
    assert judge(result).level == "bad"


@pytest.fixture(scope="module")
def measured():
    """The current is a smooth function of time that was sampled with the positions."""
    return swing(5.0, 100.0, smooth_drive=True)


def test_a_drive_that_was_measured_beside_the_positions_runs_on_between_samples(tmp_path, measured):
    result = calibrate(pendulum(tmp_path, 1e-5, topic="/js"), [noisy(measured, 1e-5)])
    assert is_right(result)
    assert judge(result).level in ("good", "warn")
    assert any("taken for measured" in said and "`held: true`" in said for said in result.findings)


@pytest.fixture(scope="module")
def fast():
    """With content of 6 Hz, of which chords between samples at 100 Hz have 1.2 % too little."""
    return swing(5.0, 100.0, smooth_drive=True, fast=3.0)


def test_torque_constants_of_a_fast_drive_that_was_measured_are_right(tmp_path, fast):
    result = calibrate(pendulum(tmp_path, 1e-5, held=", held: false"), [noisy(fast, 1e-5)])
    found = {p.name: p for p in result.parameters}["swing.torque_constant"]
    assert abs(found.value - 2.0) < 3.5 * found.sigma < 0.002  # with chords: 1.6 % high, by 11 sigma


def test_a_measured_drive_that_was_stamped_late_says_so_and_its_values_are_right(tmp_path, fast):
    stamps, currents, angles = fast
    late = noisy((stamps, currents, angles), 1e-5)
    command = replace(late.command, times=stamps + 0.015)
    robot = add_effect(pendulum(tmp_path, 1e-5, held=", held: false"), "command_delay@robot")
    result = calibrate(robot, [replace(late, streams={**late.streams, "command": command})])
    found = {p.name: p for p in result.parameters}
    delay, constant = found["robot.command_delay.delay"], found["swing.torque_constant"]
    assert abs(delay.value + 0.015) < 3.5 * delay.sigma + 1e-5
    assert abs(constant.value - 2.0) < max(3.5 * constant.sigma, 0.002)  # half a step of a staircase: 1.8 % high
    assert delay.note == "the measured drive signal is filtered or stamped late, by 15 ms"
    assert values_from_data(result)[0] == "good"


def test_the_robot_file_has_the_say_whether_a_drive_is_held(tmp_path, measured):
    robot = pendulum(tmp_path, 1e-5, topic="/js", held=", held: true")
    assert robot.command_held
    other = pendulum(tmp_path, 1e-5, topic="/current", held=", held: false")
    assert not other.command_held
    result = calibrate(other, [noisy(measured, 1e-5)])
    assert is_right(result)
    assert not any("taken for measured" in said for said in result.findings)


def test_a_measured_drive_taken_for_a_command_is_not_called_good(tmp_path, measured):
    robot = pendulum(tmp_path, 1e-5, topic="/js", held=", held: true")
    result = calibrate(robot, [noisy(measured, 1e-5)])
    assert judge(result).level != "good"
