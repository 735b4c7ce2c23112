# SPDX-License-Identifier: BSD-3-Clause
"""Trials beside a model of all kinds: the cheap way ends where the whole one does, on levers that MuJoCo moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import C0, lever_in_sight
from lever_of_all_kinds import Lever

import jointscope as js
from jointscope import simulate
from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.across_kinds import trials as trials_module
from jointscope.graphs.across_kinds.beside_still_motion import calibrate_trial, does_nothing_in_motion
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.across_kinds.shared_model import calibrate_shared
from jointscope.graphs.across_kinds.trials import Trials
from jointscope.graphs.calibration.base_model import BaseModel
from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.joint_kinds.motion_summary import MotionSummary
from jointscope.graphs.poses.calibrate_poses import calibrate_poses
from jointscope.graphs.poses.tracker_start import placed
from jointscope.graphs.rest_sets.rest_set import RestSet
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.geometry.added_effect import with_effect
from jointscope.robots.geometry.arm_effects import hypotheses
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

pytest.importorskip("mujoco", reason="levers are moved by MuJoCo, which the extra `sim` brings")
DRIFT = 1e-4  # [m]


def quiet(text, share):
    """Nobody looks."""


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """The rigid lever in sight, its recordings with a tracker that drifts, and its model without that."""
    robot = lever_in_sight(tmp_path_factory.mktemp("seen"))
    true = robot.with_values({"swing.coulomb_torque": C0})
    motion = simulate(true, seconds=6.0, seed=3, friction="smooth").recording
    poses = simulate_poses(robot, 40, 3, PoseConditions(effects=[f"tracker_drift@robot:x={DRIFT},z=0"], perfect=True))
    given = KindsRecordings((motion,), (poses[0],))
    model = calibrate_shared(robot, given, BaseModel.of(robot, given.motion), quiet)
    return given, model


def drifting(robot):
    """With what poses alone can show."""
    (drift,) = (h for h in hypotheses(robot.joints, robot.parameters, True) if h.kind.id == "tracker_drift")
    return with_effect(robot, drift, dict.fromkeys(drift.names, 0.0))


def apart(one, other):
    """Largest difference of two robots' free values, in sigmas of the other's."""
    free = [p for p in other.parameters.values() if not p.fixed]
    return max(abs(one.parameters[p.name].value - p.value) / p.sigma for p in free)


def test_the_factor_of_a_motion_is_what_its_samples_say(base):
    _, model = base
    result = model.motion.result
    summary = MotionSummary.of(result)
    robot = model.robot
    unit = np.array([robot.parameters[name].coordinate_sigma for name in summary.names])
    sets = [(problem, x, at) for problem, x, at in result.sets]
    total = summary.information + np.diag(unit**-2.0)
    for problem, x, at in sets:
        system = problem.of_robot(robot).linearize(x, at)
        index = at.columns[DYNAMICS]
        inner = np.linalg.solve(system.D, system.B)
        total += (system.C - np.einsum("kip,kiq->pq", system.B, inner))[index, index]
    np.testing.assert_allclose(np.sqrt(np.diag(np.linalg.inv(total))), np.sqrt(np.diag(summary.covariance)), rtol=1e-2)


def test_the_cost_of_the_factor_has_its_slope_and_is_least_at_zero(base):
    summary = MotionSummary.of(base[1].motion.result)
    at = Calibration.of(base[1].robot).only([DYNAMICS])
    shift = 0.3 * np.sqrt(np.diag(summary.covariance))
    x = np.zeros((0, 1))

    def cost(step):
        return summary.linearize(x, at.with_points({DYNAMICS: at.dynamics + step})).cost

    system = summary.linearize(x, at.with_points({DYNAMICS: at.dynamics + shift}))
    for i, size in enumerate(1e-3 * np.sqrt(np.diag(summary.covariance))):
        step = size * np.eye(len(shift))[i]
        slope = (cost(shift + step) - cost(shift - step)) / (2.0 * size)
        assert slope == pytest.approx(system.g_p[i], rel=1e-5, abs=1e-6 * abs(system.g_p).max())
    unit = np.array([base[1].robot.parameters[name].coordinate_sigma for name in summary.names])
    A, g = summary.information * np.outer(unit, unit), summary.linearize(x, at).g_p * unit
    lowest = at.dynamics - unit * (np.linalg.pinv(A, rcond=1e-12, hermitian=True) @ g)
    assert summary.linearize(x, at.with_points({DYNAMICS: lowest})).cost == pytest.approx(0.0, abs=1e-4)


def test_a_trial_beside_the_factor_of_the_motion_ends_where_all_samples_do(base):
    given, model = base
    grown = drifting(model.robot)
    assert does_nothing_in_motion(grown, model.robot)
    trial = calibrate_trial(grown, given, model, MotionSummary.of(model.motion.result), quiet)
    whole = calibrate_shared(grown, given, model.motion, quiet)
    assert apart(trial.robot, whole.robot) < 0.05
    drift = whole.robot.parameters["tracker.tracker_drift.x"]
    assert abs(drift.value - DRIFT) < 3.0 * drift.sigma and drift.sigma < 0.1 * DRIFT
    assert not trial.settled and whole.settled


def test_known_states_lead_where_those_from_the_measurements_do_in_fewer_steps(base):
    given, model = base
    grown = add_effect(model.robot, "motor_viscous@swing", {"coefficient": 0.0})
    warm = BaseModel.of(grown, given.motion, model.motion)
    cold = BaseModel.of(grown, given.motion, replace(model.motion, states=()))
    for p in cold.result.parameters:
        found = next(each for each in warm.result.parameters if each.name == p.name)
        assert abs(found.value - p.value) < 0.05 * p.sigma and found.sigma == pytest.approx(p.sigma, rel=0.02)
    assert len(warm.result.iterations) <= len(cold.result.iterations)


def test_no_sample_of_the_motion_is_looked_at_for_an_effect_that_does_nothing_in_it(base, monkeypatch):
    given, model = base
    monkeypatch.setattr(trials_module, "calibrate_shared", None)  # would look
    tried = Trials(given, model, quiet).of(drifting(model.robot))
    assert tried.beside is model and not tried.model.settled


@pytest.mark.slow
@pytest.mark.parametrize(
    ("label", "name", "size", "most"),
    [("payload@robot", "robot.payload.mass", 0.3, 0.01), ("link_mass@swing", "swing.link_mass.mass", 0.0, 0.1)],
)
def test_one_number_of_all_kinds_is_known_better_than_without_any_of_them(tmp_path, label, name, size, most):
    lever = Lever(tmp_path, load=size)
    given = lever.recordings("motion", "poses", "rests")
    grown = add_effect(lever.robot, label)
    if label.startswith("link_mass"):  # first moments along the lever do the same
        held = {
            n: replace(p, fixed=n.startswith("swing.link_mass.") and n != name) for n, p in grown.parameters.items()
        }
        grown = replace(grown, parameters={n: held[n] if "link_mass" in n else p for n, p in grown.parameters.items()})

    def sigma(kinds):
        near = BaseModel.of(grown, kinds.motion) if kinds.motion else None
        return known(calibrate_shared(grown, kinds, near, quiet).robot)

    def known(robot):
        p = robot.parameters[name]
        assert abs(p.value - size) < 3.0 * p.sigma
        return p.sigma

    every, still = sigma(given), sigma(replace(given, motion=()))
    assert every < most and still > 2.0 * every
    assert known(calibrate_poses(grown, given.poses).robot) > 2.0 * still
    for without in ({"poses": ()}, {"rests": ()}):  # motion knows it a hundred times better than these
        assert sigma(replace(given, **without)) > every


@pytest.mark.slow
def test_one_gap_is_known_better_with_poses_than_by_the_motion_alone(tmp_path):
    lever = Lever(tmp_path, gap=3e-4)
    given = lever.recordings("motion", "poses")
    grown = add_effect(lever.robot, "backlash@swing", {"half_gap": 2e-4})
    alone = BaseModel.of(grown, given.motion)
    both = calibrate_shared(grown, given, alone, quiet).robot.parameters["swing.backlash.half_gap"]
    own = alone.robot.parameters["swing.backlash.half_gap"]
    assert both.sigma < own.sigma
    assert abs(both.value - 3e-4) < 3.0 * both.sigma and both.sigma < 2e-5


@pytest.mark.slow
def test_one_graph_of_all_kinds_is_printed_on_a_page(tmp_path):
    lever = Lever(tmp_path)
    robot, motion = lever.robot, lever.moved(45.0)
    summary = calibrate_frequency(robot, lever.shaken()).summary.without_friction()
    sets = [RestSet.of(robot, lever.hanging()), *placed(robot, [lever.seen()])[1], summary]
    graph = js.graph(js.calibrate(robot, motion, sets=sets))
    assert graph.graph.size() < 40 and len(graph.describe().splitlines()) < 40
    assert {*graph.kinds} == {"motion", "rests", "poses", "frequency"}
    assert graph.graph.error(graph.values) > 0.0
