# SPDX-License-Identifier: BSD-3-Clause
"""Effects in poses that MuJoCo made: what is there is found first, what is not is not, and the tip comes nearer."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.graphs.joint_kinds.arm_candidates import Calibrated, arm_candidates
from jointscope.graphs.joint_kinds.discover_arm import discover_arm
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.robots.errors import EffectError, SimulationError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

FAULTS = {
    "encoder_eccentricity@joint2:cos=2e-4": ("joint2.encoder_eccentricity.cos", 2e-4),
    "joint_elasticity@joint5": ("joint5.stiffness", 1.0 / 4e-5),
    "payload@robot:mass=2": ("robot.payload.mass", 2.0),
    "tracker_drift@robot:x=2e-4": ("tracker.tracker_drift.x", 2e-4),
    "backlash@joint5:half_gap=3e-4": ("joint5.backlash", -3e-4),
    "spring_cubic@joint3:stiffness=1e11": ("joint3.spring_cubic.stiffness", 1e11),
    "gear_ripple@joint2:order=84": ("joint2.gear_ripple.cos", 8e-5 * np.cos(0.3)),
    "link_mass@joint4:mass=6": ("joint4.link_mass.mass", 6.0),
}


@pytest.fixture(scope="module")
def tx90l():
    return load_robot("tx90l")


def sessions(robot, seed, effects=()):
    conditions = PoseConditions(effects=effects)
    train, truth = simulate_poses(robot, 40, seed, conditions)
    return train, simulate_poses(robot, 80, seed, conditions, session="others")[0], truth


def test_the_engine_and_the_model_agree_about_an_arm_that_sags(tx90l):
    train, _, truth = sessions(tx90l, 11)
    mm = tip_errors(PoseSet(tx90l.with_values(truth["parameters"]), train, tx90l.poses.tracker)).to_json()
    assert mm["rms_mm"] < 0.045  # its repeatability
    assert tip_errors(PoseSet(tx90l, train, tx90l.poses.tracker)).to_json()["rms_mm"] > 0.5


@pytest.mark.parametrize("seed", [0, 5, 6])
def test_nothing_is_found_on_an_arm_to_which_nothing_was_done(tx90l, seed):
    found = discover_arm(tx90l, [sessions(tx90l, seed)[0]])
    assert [step.added for step in found.steps] == [None]
    assert "no effect is significant" in found.stop_reason


@pytest.mark.parametrize("fault", FAULTS)
def test_what_was_hidden_is_named_first_with_its_size(tx90l, fault):
    train, others, _ = sessions(tx90l, 21 if "cubic" in fault else 20, [fault])
    found = discover_arm(tx90l, [train], [others])
    assert [step.added.hypothesis.label for step in found.steps[1:]] == [fault.partition(":")[0]]
    name, truth = FAULTS[fault]
    p = found.robot.parameters[name]
    assert abs(p.value - truth) < 3.5 * p.sigma
    assert found.steps[-1].heldout.to_json()["p90_mm"] < 0.075
    before, after = (found.whitened(step, found.holdout) for step in found.steps)
    assert after < min(1.35, before)


def test_two_effects_are_found_one_after_the_other(tx90l):
    hidden = ["encoder_eccentricity@joint2:cos=2e-4", "joint_elasticity@joint5"]
    found = discover_arm(tx90l, [sessions(tx90l, 3, hidden)[0]])
    assert {step.added.hypothesis.label for step in found.steps[1:]} == {text.partition(":")[0] for text in hidden}


def test_backlash_does_not_win_over_the_softness_that_it_looks_like(tx90l):
    candidates = arm_candidates(
        Calibrated(calibrate_poses(tx90l, [sessions(tx90l, 20, ["joint_elasticity@joint5"])[0]]), None)
    )
    assert candidates[0].hypothesis.label == "joint_elasticity@joint5"


@pytest.mark.parametrize(
    ("effect", "told"),
    [
        ("foo@joint1", "effect 'foo' cannot be simulated in poses; known are backlash"),
        ("backlash@joint9", "effect backlash cannot act on 'joint9'; it acts on joint1"),
        ("backlash@joint1:gap=1", "effect backlash has no parameter 'gap'; it has half_gap"),
        ("backlash@joint1:half_gap=a", "expected param=number, got 'half_gap=a'"),
    ],
)
def test_effects_that_cannot_be_simulated_are_refused(tx90l, effect, told):
    with pytest.raises(EffectError, match=told):
        simulate_poses(tx90l, 2, 0, PoseConditions(effects=[effect]))


def test_no_poses_are_no_simulation(tx90l):
    with pytest.raises(SimulationError, match="number of poses: expected 1 or more, got 0"):
        simulate_poses(tx90l, 0)
