# SPDX-License-Identifier: BSD-3-Clause
"""Whether poses are explained: nothing answers where only noise is left, much where a response is missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken_arm import LINES, RATE, N, made_up

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.frequency.explained import explained
from jointscope.graphs.frequency.shaken_pose import ShakenPose
from jointscope.graphs.frequency.stages import first_stage, next_stage
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.signals import Signal

SIZE = 0.1  # [N m] of what is left at each line


@pytest.fixture(scope="module")
def robot():
    robot = load_robot("tx90l")
    smooth = {name: replace(p, value=1e-9, fixed=True) for name, p in robot.parameters.items() if "coulomb" in name}
    return replace(robot, parameters={**robot.parameters, **smooth})


def poses(robot, left, realisations=2, seed=0, stiffer=1.0):
    """A pose at its last stage whose motors move as the model says, `left` of the torques, shape (e, l, nu), aside.

    Args:
        robot: almost without dry friction.
        left: called with a random generator and the pose.
        realisations: number of sets of phases.
        seed: of all that is random.
        stiffer: times the third drive of the robot that the arm has.
    """
    rng = np.random.default_rng(seed)
    parts = [made_up(10 * seed + k, carrier=0.0) for k in range(realisations)]
    times = np.concatenate([s.inputs.times + 100.0 * k for k, (s, _) in enumerate(parts)])
    u, q = (np.vstack([getattr(s, side).values for s, _ in parts]) for side in ("inputs", "outputs"))
    signals, excitation = parts[0]
    experiments = tuple(
        replace(e, realisation=k, start=e.start + 100.0 * k) for k, (_, x) in enumerate(parts) for e in x.experiments
    )
    inputs, outputs = Signal(times, u, signals.inputs.names), Signal(times, q, signals.outputs.names)
    signals = replace(signals, inputs=inputs, outputs=outputs, path=f"pose{seed}")
    pose = ShakenPose.of(signals, replace(excitation, experiments=experiments))
    at, first = Calibration.of(robot).only([DYNAMICS]), first_stage(robot, pose)
    values = first.values(at)
    values["joint3.stiffness"] *= stiffer
    G = np.linalg.inv(first.with_friction(first.stiffness(values).Z, values))
    Y = np.zeros_like(pose.found.Y)
    Y[:, :, pose.lines] = np.einsum("lij,elj->eli", G, pose.torques + left(rng, pose))[:, None]
    problem = first_stage(robot, replace(pose, found=replace(pose.found, Y=Y)))
    for _ in range(4):
        problem = next_stage(problem, at)
    return problem


def noise(rng, pose):
    shape = pose.torques.shape
    return SIZE * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


def response(rng, pose):
    """A mode that the model lacks: a smooth answer to the torques."""
    more = 0.05 / (1.0 + 1j * (pose.w / (2.0 * np.pi) - 40.0) / 100.0)
    return more[None, :, None] * pose.torques + 0.1 * noise(rng, pose)


@pytest.mark.parametrize("realisations", [1, 2])
def test_noise_answers_nothing(robot, realisations):
    (found,) = explained(robot, [poses(robot, noise, realisations)]).poses
    assert found.by_realisations == (realisations > 1)
    assert all(abs(band.share) < 4.0 * band.sigma for band in found.answered)
    assert len(found.answered) > 5 and found.answered[0].low == RATE / N * LINES[0]


@pytest.mark.parametrize("realisations", [1, 2])
def test_a_response_that_is_missing_comes_again(robot, realisations):
    (found,) = explained(robot, [poses(robot, response, realisations)]).poses
    sure = [band for band in found.answered if band.share > 0.5 and band.share > 4.0 * band.sigma]
    assert len(sure) >= 5


def test_realisations_and_poses_of_one_arm_agree_and_predict_each_other(robot):
    both = [poses(robot, noise, 2, seed) for seed in (1, 2)]
    found = explained(robot, both)
    assert set(found.between_poses) == {"pose1", "pose2"} and set(found.heldout) == {0, 1}
    tests = [*found.between_poses.values(), *found.between_realisations.values()]
    assert all(not test.doubtful and test.dof > 0 for test in tests)
    assert all(0.5 < error < 1.5 * found.fitted[number] for number, error in found.heldout.items())


def test_a_pose_of_another_arm_does_not_agree(robot):
    found = explained(robot, [poses(robot, noise, 2, 1), poses(robot, noise, 2, 2, stiffer=1.05)])
    assert all(test.doubtful for test in found.between_poses.values())


def test_one_realisation_of_one_pose_has_nothing_to_be_compared_with(robot):
    found = explained(robot, [poses(robot, noise, 1)])
    assert not found.between_poses and not found.between_realisations and not found.heldout
