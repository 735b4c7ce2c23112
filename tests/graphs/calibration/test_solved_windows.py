# SPDX-License-Identifier: BSD-3-Clause
"""Windows speak for recordings only where every joint moves in them as it does elsewhere."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from simulated_arm import Arm, moved, robot_file

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.stages import solved_windows
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.noise.noise_estimation import NoiseEvidence
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording

ARM = Arm("yxy")


@pytest.fixture(scope="module")
def motions(tmp_path_factory):
    """Four recordings of 6.6 s, of which windows hold the beginning alone."""
    robot = load_robot(robot_file(ARM, tmp_path_factory.mktemp("arm")))
    problems = []
    for seed in range(9, 13):
        encoder, command = moved(ARM, seconds=6.6, seed=seed)
        recording = Recording(f"{seed}.mcap", "", 10**18, {"encoder": encoder, "command": command})
        problems.append(BagProblem.of(robot, recording))
    return problems, [initial_states(problem, Calibration.of(robot)) for problem in problems]


def solved(problems, states):
    robot = problems[0].robot
    estimate = Estimate(tuple(states), tuple(Calibration.of(robot) for _ in problems))
    evidence = NoiseEvidence.empty(robot.layout.n_rates)
    return Solved(problems, SimpleNamespace(estimate=estimate), [], np.zeros((0, 0)), [], evidence, [])


def test_windows_in_which_all_joints_move_are_asked_first(motions):
    problems, states = motions
    test = solved_windows.tested_on_windows(solved(problems, states))
    assert test is not None and test.seconds < 0.5 * sum(float(np.ptp(p.timeline.ticks)) for p in problems)


@pytest.mark.parametrize("joint", [0, 1, 2])
def test_all_samples_are_asked_where_a_joint_stands_in_the_windows(motions, joint):
    problems, states = motions
    later = []
    for problem, x in zip(problems, states, strict=True):
        x, layout = x.copy(), problem.robot.layout
        x[problem.timeline.ticks < 3.0, layout.joint_v[joint]] = 0.0
        later.append(x)
    assert solved_windows.tested_on_windows(solved(problems, later)) is None
