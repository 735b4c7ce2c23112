# SPDX-License-Identifier: BSD-3-Clause
"""Effects in poses that MuJoCo made: what is there is found first, what is not is not, and the tip comes nearer."""

from __future__ import annotations

import re

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
from jointscope.tools.terminal.searches.arm_discovery_text import limit_sentences

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


HIDDEN = (
    *(f"gear_ripple@joint{j}:amplitude=8e-5,order={n}" for j, n in ((1, 45), (2, 96), (3, 96))),
    *(f"joint_elasticity@joint{j}:compliance=4e-5" for j in (4, 5, 6)),
    *(f"spring_cubic@joint{j}:stiffness=4e10" for j in (2, 3)),
    *(f"encoder_eccentricity@joint{j}:cos=-1e-4,sin=-1e-4" for j in (2, 4)),
)


def test_few_poses_say_how_many_more_would_tell_which_effect_and_so_many_do(tx90l):
    """Forty poses of an arm with ten effects name one that they do not show; with as many more as they say it shows."""
    conditions = PoseConditions(effects=HIDDEN)
    few = discover_arm(tx90l, [simulate_poses(tx90l, 40, 60, conditions)[0]])
    assert all(step.added is None or step.added.hypothesis.label != "gear_ripple@joint1" for step in few.steps)
    said = limit_sentences(few.steps[-1])[0]
    ripple, more = re.search(r"gear_ripple@joint1 \(([^ ]+) rad\) with about (\d+) more", said).groups()
    assert ripple.startswith("8.") and "10⁻⁵" in ripple  # 8e-5 is true
    assert 5 <= int(more) <= 20
    enough = discover_arm(tx90l, [simulate_poses(tx90l, 40 + int(more), 60, conditions)[0]])
    assert "gear_ripple@joint1" in [step.added.hypothesis.label for step in enough.steps[1:]]


def test_a_payload_that_would_not_show_is_told_by_its_size(tx90l):
    found = discover_arm(tx90l, [sessions(tx90l, 30, ["payload@robot:mass=0.5"])[0]])
    assert len(found.steps) == 1
    low = float(re.search(r"payload below ([\d.]+) kg", limit_sentences(found.steps[-1])[-1]).group(1))
    assert 0.6 < low < 1.2
    shown = discover_arm(tx90l, [sessions(tx90l, 30, [f"payload@robot:mass={2.0 * low}"])[0]])
    assert shown.steps[1].added.hypothesis.label == "payload@robot"
