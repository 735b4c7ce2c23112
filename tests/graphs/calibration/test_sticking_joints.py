# SPDX-License-Identifier: BSD-3-Clause
"""Arms whose dry friction truly holds a joint that stands: right values, and what is named is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, assert_right, moved, robot_file

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.verdicts.judgement import judge

pytestmark = pytest.mark.slow

ARM = Arm("yxy", dry=(4.0, 1.5, 0.5))
LATE = 2e-3  # [s]
PUSH = (4.0, 4.25, 1, 4.0)


@pytest.fixture
def robot(tmp_path):
    return load_robot(robot_file(ARM, tmp_path))


def recorded(late=0.0, **how):
    encoder, command = moved(ARM, encoder_rate=250.0, command_rate=250.0, sticks=True, **how)
    command = replace(command, times=command.times - late)
    return Recording("stick.mcap", "", 10**18, {"encoder": encoder, "command": command})


def test_what_holds_a_joint_is_in_no_row_but_its_own(robot):
    recording = replace(recorded(), sticking={"j1": ((2.0, 3.0),)})
    steps = BagProblem.of(robot, recording).dynamics.steps
    held, rows = np.nonzero(steps.free > 0.0)
    assert set(rows) == {1}
    k = int(held[len(held) // 2])
    middle = recording.command.times[k] + 0.5 * steps.h[k]
    assert 2.0 < middle < 3.0
    q = [np.interp(middle, recording.streams["encoder"].times, c) for c in recording.streams["encoder"].values.T]
    M = robot.tree.mass_matrix(np.array([q]))[0] + np.diag([0.4, 0.4, 0.4])  # the rotors of the file
    rows_of_torque = steps.weight[k] @ np.linalg.solve(M, np.array([0.0, 1.0, 0.0]))
    np.testing.assert_allclose(rows_of_torque[[0, 2]], 0.0, atol=1e-9 * abs(rows_of_torque[1]))


def timing_check(result):
    return next(check for check in judge(result).checks if check.name.endswith("at the same time"))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_sticking_arm_is_right_and_good_and_nothing_is_named(robot, seed):
    result = calibrate(robot, [recorded(seed=seed)])
    assert_right(ARM, result.parameters, rel=0.005)
    assert judge(result).level == "good"
    assert timing_check(result).level == "good"
    assert result.bags[0].isolated == ()


def test_a_command_that_acts_late_on_a_sticking_arm_is_found(robot):
    result = calibrate(robot, [recorded(late=LATE)])
    assert result.timing.delay == pytest.approx(LATE, rel=0.15)
    assert timing_check(result).level in ("warn", "bad")


def test_a_push_on_a_sticking_arm_is_found_when_and_where_it_was(robot):
    (moment,) = calibrate(robot, [recorded(push=PUSH)]).bags[0].isolated
    assert moment.row == "j1.link"
    assert moment.t0 < PUSH[0] + 0.1 and moment.t1 > PUSH[1] - 0.1
    assert moment.torque == pytest.approx(PUSH[3], rel=0.2)


@pytest.mark.parametrize("stated", [2.0e-5, 2.3e-5])
def test_a_sticking_arm_that_is_sampled_slowly_keeps_the_noise_of_its_encoder(tmp_path, stated):
    heavy = Arm("yy", inertia=(0.3, 0.08), dry=(4.0, 1.2), viscous=(0.4, 0.1))
    encoder, command = moved(heavy, encoder_rate=50.0, command_rate=50.0, noise=2e-5, sticks=True)
    path = robot_file(heavy, tmp_path)
    path.write_text(path.read_text().replace("sigma: 1.0e-5", f"sigma: {stated}"))
    result = calibrate(load_robot(path), [Recording("slow.mcap", "", 10**18, {"encoder": encoder, "command": command})])
    assert_right(heavy, result.parameters, rel=0.015)
    # at a process noise that is still too large the states follow the samples, and what they leave looks smaller
    assert np.all(result.robot.motor_encoder.sigmas > 0.8 * 2e-5)
    assert judge(result).level in ("good", "warn")
