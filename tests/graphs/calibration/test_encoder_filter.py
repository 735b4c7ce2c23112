# SPDX-License-Identifier: BSD-3-Clause
"""Positions that a driver has smoothed: refused with a delay alone, named, and right with the filter in the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, moved, robot_file

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.verdicts.judgement import judge

ARM = Arm(axes="zy", inertia=(0.3, 0.1), dry=(0.9, 0.5), viscous=(0.6, 0.3))
RATE, KEPT = 250.0, np.exp(-1.0 / (250.0 * 0.015))  # share of the last output in the next: 15 ms of first order
TRUTH = {"inertia": ARM.inertia, "coulomb_torque": ARM.dry, "motor_viscous.coefficient": ARM.viscous}


def low_passed(values: np.ndarray) -> np.ndarray:
    """As a driver does it: the last output and the new sample, weighed, message by message."""
    found = values.copy()
    for k in range(1, len(values)):
        found[k] = KEPT * found[k - 1] + (1.0 - KEPT) * values[k]
    return found + 1e-4 * np.random.default_rng(7).standard_normal(values.shape)


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    loaded = load_robot(robot_file(ARM, tmp_path_factory.mktemp("arm")))
    encoder = loaded.motor_encoder
    return loaded.with_sensors({encoder.name: replace(encoder, sigmas=np.full(2, 1e-4))})


@pytest.fixture(scope="module")
def streams():
    return moved(ARM, seconds=8.0, encoder_rate=RATE, command_rate=RATE)


def calibrated(robot, encoder, command):
    return calibrate(robot, [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])


def deviations(result):
    """Of all values: in shares, and in sigmas."""
    table = result.found
    found = [(table[f"j{i}.{law}"], values[i]) for law, values in TRUTH.items() for i in range(2)]
    return [(value.value / truth - 1.0, (value.value - truth) / value.sigma) for value, truth in found]


def check(result):
    return next(check for check in judge(result).checks if check.name.endswith("missing effect would change"))


def test_a_filter_is_named_beside_the_delay_that_hides_it_and_makes_the_values_right(robot, streams):
    encoder, command = streams
    smoothed = replace(encoder, values=low_passed(encoder.values))
    late = add_effect(robot, "command_delay@robot")
    wrong = calibrated(late, smoothed, command)
    assert any(abs(share) > 0.01 and abs(sigmas) > 3.5 for share, sigmas in deviations(wrong)), "the filter must harm"
    assert check(wrong).level == "bad" and judge(wrong).level == "bad"
    assert "The recording calls for encoder_filter@robot" in check(wrong).text
    file = str(robot.path).removesuffix(".yaml")
    assert f"`jointscope add {file}.yaml encoder_filter@robot -o {file}_encoder_filter.yaml`" in check(wrong).text
    mended = calibrated(add_effect(late, "encoder_filter@robot"), smoothed, command)
    assert all(abs(share) < 0.01 or abs(sigmas) < 3.5 for share, sigmas in deviations(mended))
    assert judge(mended).level in ("good", "warn")
    before, after = (np.max(np.abs([share for share, _ in deviations(r)])) for r in (wrong, mended))
    assert after < 0.15 * before
    # that of the weights, (1 - a) a^k; a little smaller, as they have tails and joints turn over within them
    variance = mended.found["robot.encoder_filter.variance"].value * RATE**2
    assert 0.85 < variance / (KEPT / (1.0 - KEPT) ** 2) < 1.05


def test_a_delay_alone_asks_for_no_filter(robot, streams):
    encoder, command = streams
    noisy = encoder.values + 1e-4 * np.random.default_rng(7).standard_normal(encoder.values.shape)
    earlier = replace(command, times=command.times - 6e-3)
    result = calibrated(add_effect(robot, "command_delay@robot"), replace(encoder, values=noisy), earlier)
    assert result.found["robot.command_delay.delay"].value == pytest.approx(6e-3, rel=0.05)
    assert check(result).level == "good"
    assert all(abs(share) < 0.01 or abs(sigmas) < 3.5 for share, sigmas in deviations(result))


@pytest.mark.slow
def test_a_filter_that_was_added_in_vain_harms_no_value(tmp_path):
    """Long filters free the states to follow the noise of readings: their lowest cost falls, but their likelihood, too.

    With the lowest cost a filter of 14 ms was found here, and an inertia that was 78 % too small.
    """
    light = Arm(axes="zy", inertia=(7.2e-3, 1.7e-4), dry=(8e-3, 2e-3), viscous=(7e-3, 2e-3))
    loaded = load_robot(robot_file(light, tmp_path))
    encoder = loaded.motor_encoder
    loaded = loaded.with_sensors({encoder.name: replace(encoder, sigmas=np.full(2, 2e-5))})
    samples, command = moved(light, seconds=5.0, encoder_rate=1000.0, command_rate=1000.0, noise=2e-5, seed=2)
    earlier = replace(command, times=command.times - 2e-3)
    robot = add_effect(add_effect(loaded, "command_delay@robot"), "encoder_filter@robot")
    result = calibrated(robot, samples, earlier)
    assert result.found["robot.command_delay.delay"].value == pytest.approx(2e-3, rel=0.1)
    assert result.found["robot.encoder_filter.variance"].value < 2e-3**2
    truth = {"inertia": light.inertia, "coulomb_torque": light.dry, "motor_viscous.coefficient": light.viscous}
    for law, values in truth.items():
        for i, true in enumerate(values):
            value = result.found[f"j{i}.{law}"]
            assert abs(value.value / true - 1.0) < 0.01 or abs(value.value - true) < 3.5 * value.sigma, (law, i, value)
