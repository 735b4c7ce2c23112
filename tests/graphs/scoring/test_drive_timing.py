# SPDX-License-Identifier: BSD-3-Clause
"""A drive signal that was measured a little before or after the positions: found, said, and put right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from simulated_arm import Arm, assert_right, moved, robot_file
from slow_pendulum import TRUTH, pendulum, recorded, swing

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.scoring.regression.asked_by_regression import Asked
from jointscope.graphs.scoring.regression.unsteady_gains import SPEED, UnsteadyGain
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.verdicts.judgement import judge

SIGMA, EFFORT_NOISE = 1e-5, 0.002  # [rad], [1] of the largest current
DELAY = "robot.command_delay.delay"


@pytest.fixture(scope="module")
def smooth():
    """A current that is a smooth function of time, sampled with the positions."""
    return swing(9.0, 100.0, smooth_drive=True)


@pytest.fixture(scope="module")
def held():
    """Currents that act until the next one."""
    return swing(6.0, 100.0)


def measured(found, late):
    """Positions with noise, and currents with noise that were so a time `late` before their stamp [s]."""
    stamps, currents, angles = found
    rng = np.random.default_rng(5)
    noise = EFFORT_NOISE * np.abs(currents).max() * rng.standard_normal(currents.shape)
    past = CubicSpline(stamps, currents)(stamps - late)
    return recorded(stamps, past + noise, angles + SIGMA * rng.standard_normal(angles.shape))


def commanded(found, late):
    """Positions with noise, and the commands with stamps from which it takes a time `late` until they act [s]."""
    stamps, currents, angles = found
    rng = np.random.default_rng(6)
    recording = recorded(stamps, currents, angles + SIGMA * rng.standard_normal(angles.shape))
    command = recording.streams["command"]
    earlier = type(command)(command.name, command.times - late, command.values, command.channels, command.unit)
    return type(recording)("swing.mcap", "", 0, {**recording.streams, "command": earlier})


def deviations(result):
    """Of the values with a truth: in sigmas and in shares."""
    table = {p.name: p for p in result.parameters}
    return {n: ((table[n].value - t) / table[n].sigma, table[n].value / t - 1.0) for n, t in TRUTH.items()}


def is_right(result):
    return all(abs(sigmas) < 3.5 or abs(share) < 0.01 for sigmas, share in deviations(result).values())


def same_time(result):
    return next(check for check in judge(result).checks if check.name.endswith("at the same time"))


def test_noise_of_the_measured_current_alone_is_no_harm(tmp_path, smooth):
    result = calibrate(pendulum(tmp_path, SIGMA, topic="/js"), [measured(smooth, 0.0)])
    assert is_right(result)
    assert same_time(result).level == "good"
    assert abs(result.timing.delay) < 4.0 * result.timing.sigma
    assert judge(result).level in ("good", "warn")


@pytest.mark.parametrize("late", [2e-3, -2e-3])
def test_a_current_of_another_time_than_the_positions_is_not_called_good(tmp_path, smooth, late):
    result = calibrate(pendulum(tmp_path, SIGMA, topic="/js"), [measured(smooth, late)])
    assert not is_right(result)
    # the torque acts before its stamp where the current is old
    assert result.timing.delay == pytest.approx(-late, rel=0.1)
    check = same_time(result)
    assert check.level in ("warn", "bad") and judge(result).level != "good"
    assert ("before" if late > 0.0 else "after") in check.text
    file = tmp_path / "pendulum"
    assert f"`jointscope add {file}.yaml command_delay@robot -o {file}_command_delay.yaml`" in check.text
    # what has another reason is not said to be late, unless a delay explains about as much
    gain = UnsteadyGain("joint", SPEED, 0.05, 0.001, 0.99, {}, 100.0, 5.0)
    assert same_time(replace(result, asked=Asked(gains=(gain,), late=False))).level == "info"
    assert same_time(replace(result, asked=Asked(gains=(gain,), late=True))).level == check.level


@pytest.mark.parametrize("late", [-2e-3, 12e-3])
def test_what_the_verdict_says_to_type_puts_the_values_right(tmp_path, smooth, late):
    robot = add_effect(pendulum(tmp_path, SIGMA, topic="/js"), "command_delay@robot")
    result = calibrate(robot, [measured(smooth, late)])
    assert is_right(result)
    delay = result.robot.parameters[DELAY]
    assert abs(delay.value + late) < 3.5 * delay.sigma < 1e-3
    assert judge(result).level in ("good", "warn")
    assert result.timing is None and same_time(result).level == "info"


def test_commands_that_act_at_their_stamps_are_not_accused(tmp_path, held):
    result = calibrate(pendulum(tmp_path, SIGMA), [commanded(held, 0.0)])
    assert is_right(result)
    assert same_time(result).level == "good"


def test_commands_that_act_late_are_not_called_good(tmp_path, held):
    result = calibrate(pendulum(tmp_path, SIGMA), [commanded(held, 2e-3)])
    assert not is_right(result)
    assert result.timing.delay == pytest.approx(2e-3, rel=0.2)
    assert same_time(result).level in ("warn", "bad")


@pytest.mark.parametrize(
    ("late", "joint", "what"),
    [(0.0, "", ""), (4e-3, "j2", "The encoder of j2 seems to be read"), (-4e-3, "j2", "The drive signal of j2 seems")],
)
def test_one_joint_of_another_time_than_the_others_is_named(tmp_path, late, joint, what):
    arm = Arm("yxy")
    encoder, command = moved(arm, encoder_rate=200.0, command_rate=200.0)
    values = encoder.values.copy()
    values[:, 2] = np.interp(encoder.times - late, encoder.times, values[:, 2])
    recording = Recording("late.mcap", "", 10**18, {"encoder": replace(encoder, values=values), "command": command})
    result = calibrate(load_robot(robot_file(arm, tmp_path)), [recording])
    check = same_time(result)
    if not late:
        assert_right(arm, result.parameters, rel=0.005)
        assert check.level == "good" and judge(result).level == "good"
        return
    assert result.timing.joint == joint and result.timing.delay == pytest.approx(late, rel=0.3)
    assert check.level == "bad" and check.text.startswith(what) and "correct its stamps" in check.text
