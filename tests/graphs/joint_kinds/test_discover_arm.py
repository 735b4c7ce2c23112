# SPDX-License-Identifier: BSD-3-Clause
"""What frequency responses, alone and with poses, say that an arm lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken_arm import TX90L

from jointscope.graphs.joint_kinds.arm_candidates import arm_candidates
from jointscope.graphs.joint_kinds.discover_arm import discover_arm
from jointscope.graphs.joint_kinds.likeliest_effect import calibrated
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.geometry.arm_effects import FREQUENCY, KINDS, POSES, hypotheses
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.bags.at_poses.read_shaken import read_shaken

made_elsewhere = [
    pytest.mark.slow,
    pytest.mark.skipif(not TX90L.is_dir(), reason="shared/data/tx90l is not beside the project"),
]


def recordings(robot, share=0.0):
    """Of the arm made elsewhere; motor 2 says less torque than it makes by a share."""
    found = []
    for name in ("P1", "P3"):
        signals, excitation = read_shaken(TX90L / "frequency" / f"frequency_{name}", robot)
        scale = np.array([1.0, 1.0 / (1.0 + share), 1.0])
        inputs = replace(signals.inputs, values=signals.inputs.values * scale)
        found.append((replace(signals, inputs=inputs), excitation))
    return found


def test_every_kind_of_effect_is_shown_by_poses_or_by_responses():
    assert all({POSES, FREQUENCY} - kind.unseen.keys() for kind in KINDS)


def test_effects_of_motors_are_asked_of_those_that_are_shaken_alone():
    robot = load_robot("tx90l")
    alone = {h.label for h in hypotheses(robot.joints, robot.parameters, True)}
    both = {h.label for h in hypotheses(robot.joints, robot.parameters, True, robot.frequency.joints)}
    assert alone < both
    assert "torque_constant_error@joint3" in both and "torque_constant_error@joint4" not in both
    assert "torque_delay@robot" in both - alone and "tracker_drift@robot" in alone


@pytest.mark.parametrize("both", [False, True])
def test_nothing_is_found_where_nothing_was_done(both):
    robot = load_robot("tx90l")
    sessions = [read_poses(TX90L / "poses_calibration", robot)] if both else []
    candidates = arm_candidates(calibrated(robot, sessions, recordings(robot)))
    assert not [c.hypothesis.label for c in candidates if c.verdict == "missing"]
    kinds = {FREQUENCY, POSES} if both else {FREQUENCY}
    assert all(set(c.gains) == kinds - c.hypothesis.kind.unseen.keys() for c in candidates if c.hypothesis.kind.soft)


def test_a_motor_that_says_too_little_torque_is_found_and_sized():
    robot = load_robot("tx90l")
    found = discover_arm(robot, recordings=recordings(robot, 0.05))
    assert [step.added.hypothesis.label for step in found.steps[1:]] == ["torque_constant_error@joint2"]
    p = found.robot.parameters["joint2.torque_constant_error.share"]
    assert abs(p.value - 0.05) < 0.002
    assert found.steps[1].left < 0.8 * found.steps[0].left
    assert found.steps[1].added.shown_by == (FREQUENCY,)


for test in (test_nothing_is_found_where_nothing_was_done, test_a_motor_that_says_too_little_torque_is_found_and_sized):
    test.pytestmark = [*getattr(test, "pytestmark", []), *made_elsewhere]
