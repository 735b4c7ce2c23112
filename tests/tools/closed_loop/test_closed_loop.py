# SPDX-License-Identifier: BSD-3-Clause
"""Ball hitting in the simulator: plans within limits, laws from the robot file, sources that know what they may."""

from dataclasses import replace

import numpy as np
import pytest
from holding_estimator import HoldingEstimator

from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.errors import RobotError, SimulationError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.closed_loop.planning.hitting_plan import COMMAND_SHARE, head_jacobian, hitting_plan, speed_limits
from jointscope.tools.closed_loop.planning.optimal_gains import OptimalGains
from jointscope.tools.closed_loop.planning.passage import Passage
from jointscope.tools.closed_loop.planning.reference import model_reference, parameter_values
from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop
from jointscope.tools.closed_loop.sources.differentiated_encoders import DifferentiatedEncoders
from jointscope.tools.simulator.loop.controller import GAIN, full_command
from jointscope.tools.simulator.loop.online_sensors import Sample
from jointscope.tools.simulator.occasion import Conditions
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.engine import TICK

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

SECONDS = 3.5
TIMES = np.arange(round(SECONDS / TICK)) * TICK


@pytest.fixture(scope="module")
def truth():
    return true_robot(load_robot("doggy"), {})


@pytest.fixture(scope="module")
def plan(truth):
    return hitting_plan(truth, TIMES, np.array([0.1, -0.05, 0.08]), np.random.default_rng(4))


@pytest.fixture(scope="module")
def loops():
    """Both controllers with the true state, with encoders, and with an estimator that remembers what it was told."""
    made = []

    def make(robot, lag):
        made.append(HoldingEstimator(robot, lag))
        return made[-1]

    result = run_closed_loop(load_robot("doggy"), None, SECONDS, 3, options=LoopOptions(make_estimator=make))
    return result, made


def test_a_passage_meets_both_ends_up_to_the_jerk():
    q0, v0, q1, v1 = np.random.default_rng(0).uniform(-1, 1, (4, 3))
    passage = Passage(q0, v0, q1, v1, 0.7)
    for order, (first, last) in enumerate([(q0, q1), (v0, v1), (0.0, 0.0), (0.0, 0.0)]):
        np.testing.assert_allclose(passage.at(np.array([0.0]), order)[0], first, atol=1e-8)
        np.testing.assert_allclose(passage.at(np.array([0.7]), order)[0], last, atol=1e-8)
    t = np.linspace(0.1, 0.6, 5)
    slope = (passage.at(t + 1e-6) - passage.at(t - 1e-6)) / 2e-6
    np.testing.assert_allclose(passage.at(t, 1), slope, rtol=1e-6, atol=1e-6)


def test_the_plan_moves_the_head_within_the_limits_of_joints_and_drives(truth, plan):
    low, high = truth.tree.limits.T
    assert len(plan.hits) >= 1
    assert np.all((plan.q >= low) & (plan.q <= high))
    assert np.all(np.abs(plan.v) <= speed_limits(truth))
    u = model_reference(truth, plan.times, plan.q, plan.v, plan.a).u
    assert 0.5 * COMMAND_SHARE < np.abs(u).max() <= 1.02 * COMMAND_SHARE
    for hit in plan.hits:
        at = plan.tick(hit.time)
        np.testing.assert_allclose(plan.q[at], hit.q, atol=5e-3)
        assert np.linalg.norm(head_jacobian(truth, hit.q) @ hit.v) > 0.5  # [m/s]
        assert np.abs(plan.q[plan.tick(hit.back) : plan.tick(hit.end)] - plan.home).max() < 1e-6


def test_another_seed_hits_elsewhere_and_the_same_seed_there_again(truth, plan):
    home = plan.home
    again, other = (hitting_plan(truth, TIMES, home, np.random.default_rng(seed)) for seed in (4, 5))
    np.testing.assert_array_equal(again.q, plan.q)
    assert np.abs(other.hits[0].q - plan.hits[0].q).max() > 0.1


def test_the_model_itself_follows_the_reference_without_feedback(truth, plan):
    """A plain integration of the equations of motion with the commands of the reference stays on the plan."""
    reference, model = model_reference(truth, plan.times, plan.q, plan.v, plan.a), ElasticJoints(truth)
    parameters, layout, x = parameter_values(model, truth), truth.layout, reference.x[0].copy()

    def rate(x, u):
        dx = np.zeros_like(x)
        dx[layout.positions] = x[layout.velocities]
        dx[layout.velocities] = model.accelerations(x[None], u[None], parameters)[0]
        return dx

    errors = []
    for k in range(plan.tick(plan.hits[0].back)):
        u = reference.u[k]
        middle = x + 0.5 * TICK * rate(x, u)
        x = x + TICK * rate(middle, u)
        errors.append(x - reference.x[k + 1])
    assert np.abs(np.array(errors)[:, layout.q_link]).max() < 3e-3  # [rad] of 0.5 and more
    assert np.abs(np.array(errors)[:, layout.v_link]).max() < 2e-2  # [rad/s]


def test_gains_make_the_linearised_model_stable_and_grow_with_the_motor(truth, plan):
    reference, full = model_reference(truth, plan.times, plan.q, plan.v, plan.a), full_command(truth)
    gains = OptimalGains(truth, reference, TICK, full).at(0)
    assert gains.shape == (3, truth.layout.size)
    heavy = truth.with_values({"motor.inertia": 3.0 * truth.parameter("motor.inertia").value})
    v_motor = truth.layout.motor_v
    heavy_gains = OptimalGains(heavy, reference, TICK, full).at(0)
    assert np.all(heavy_gains[range(3), v_motor] > gains[range(3), v_motor])


def test_a_model_with_a_soft_bearing_has_gains_and_a_reference_for_it(truth, plan):
    model = add_effect(truth, "bearing_flexibility@joint1")
    reference = model_reference(model, plan.times, plan.q, plan.v, plan.a)
    tilt = reference.x[:, model.layout.links.index("joint1.bearing_x")]
    assert 1e-4 < np.abs(tilt).max() < 0.1  # [rad]
    gains = OptimalGains(model, reference, TICK, full_command(model))
    assert gains.at(100).shape == (3, model.layout.size)


@pytest.mark.slow
def test_state_feedback_with_the_true_state_tracks_far_better_than_the_p_controller(loops):
    result, _ = loops
    p, feedback = (result.run(controller, "true").tracking for controller in ("p", "state_feedback"))
    assert feedback.link_position_rms < 0.02 * p.link_position_rms
    assert feedback.hit_position < 3e-3  # [m]
    assert feedback.hit_velocity < 0.02 * p.hit_velocity
    assert feedback.settling == 0.0
    assert feedback.saturated < 0.01


@pytest.mark.slow
def test_the_true_state_is_true_and_encoders_know_less(loops):
    result, _ = loops
    assert max(result.run("p", "true").tracking.estimation.values()) == 0.0
    encoders = result.run("state_feedback", "encoders").tracking
    true = result.run("state_feedback", "true").tracking
    assert encoders.estimation["v_link"] > 0.01  # [rad/s]
    assert encoders.chatter > 5.0 * true.chatter
    assert encoders.hit_position > 2.0 * true.hit_position


@pytest.mark.slow
def test_the_p_law_is_that_of_the_paper(loops):
    result, _ = loops
    for run in (result.run("p", "true"), result.run("p", "encoders")):
        q_motor = run.estimates[:, 6:9]
        np.testing.assert_allclose(run.commands, np.clip(GAIN * (result.plan.q - q_motor), -1, 1), atol=1e-12)


@pytest.mark.slow
def test_an_estimator_is_told_every_sample_and_every_command_in_time(loops):
    result, made = loops
    assert len(made) == 2  # one per run, nothing is carried over
    fake, run = made[1], result.run("state_feedback", "estimator")
    ticks = len(result.plan.times)
    assert len(fake.asked) == len(fake.commands) == ticks
    np.testing.assert_allclose([t for t, _ in fake.commands], result.plan.times)
    np.testing.assert_array_equal([u for _, u in fake.commands], run.commands)
    names = [name for name, _, _ in fake.samples]
    assert set(names) == {"motor_encoder", "imu1", "imu2"}
    assert names.count("motor_encoder") > ticks - 20
    encoder = {t: values for name, t, values in fake.samples if name == "motor_encoder"}
    recorded = run.recording.streams["motor_encoder"]
    np.testing.assert_allclose([encoder[t] for t in recorded.times[:500]], recorded.values[:500], atol=1e-12)


@pytest.mark.slow
def test_before_an_estimator_knows_anything_the_plan_is_believed(loops):
    result, _ = loops
    run = result.run("state_feedback", "estimator")
    np.testing.assert_array_equal(run.estimates[0, :3], result.plan.q[0])


@pytest.mark.slow
def test_all_runs_see_the_same_robot_plan_and_noise(loops):
    result, _ = loops
    starts = np.array([run.states[0] for run in result.runs])
    np.testing.assert_array_equal(starts, np.tile(starts[0], (len(starts), 1)))
    noise = [run.recording.streams["motor_encoder"].received for run in result.runs]
    for other in noise[1:]:
        np.testing.assert_array_equal(other, noise[0])


@pytest.mark.slow
def test_a_hidden_effect_changes_the_truth_but_not_the_hits():
    robot, options = load_robot("doggy"), LoopOptions(("state_feedback",), ("true",))
    plain = run_closed_loop(robot, None, 3.0, 3, options=options)
    soft = run_closed_loop(robot, None, 3.0, 3, Conditions(effects=["bearing_flexibility@joint1"]), options)
    np.testing.assert_array_equal(plain.plan.q, soft.plan.q)
    assert soft.runs[0].tracking.head_position > 1.5 * plain.runs[0].tracking.head_position


@pytest.mark.slow
def test_without_a_model_file_the_parameters_are_a_little_off_and_gyros_as_mounted():
    robot = load_robot("doggy")
    result = run_closed_loop(robot, None, 3.0, 3, options=LoopOptions(("p",), ("true",), mismatch=0.05))
    true = result.truth["parameters"]
    off = [p.value / true[p.name] - 1.0 for p in result.model.parameters.values()]
    assert 0.01 < np.std(off) < 0.1
    np.testing.assert_allclose(result.model.gyros[0].R_imu_body, true["imu1.R_imu_body"], atol=1e-12)


def test_differentiated_encoders_are_a_low_pass_of_differences(truth, plan):
    reference = model_reference(truth, plan.times, plan.q, plan.v, plan.a)
    source = DifferentiatedEncoders(truth, reference, cutoff=40.0)
    for k in range(400):
        source.take(Sample("motor_encoder", k * TICK, np.full(3, 0.5 * k * TICK)))
    source.take(Sample("motor_encoder", 0.1, np.full(3, 99.0)))  # older than the last: ignored
    source.take(Sample("imu1", 0.4, np.zeros(3)))
    x = source.state(300, 0.3, None)
    np.testing.assert_allclose(x[truth.layout.motor_v], 0.5, rtol=1e-6)
    np.testing.assert_allclose(x[truth.layout.motor_q], 0.5 * 0.399, rtol=1e-9)
    planned = reference.x[300]
    stretch = x[truth.layout.joint_q] - x[truth.layout.motor_q]
    np.testing.assert_allclose(stretch, planned[truth.layout.joint_q] - planned[truth.layout.motor_q], atol=1e-12)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (
            {"controllers": ("pid",)},
            "unknown controller 'pid'; expected p, state_feedback, pd_link, pd_link_gravity, "
            "pd_both, pd_both_friction, pd_motor_friction, inverse_dynamics",
        ),
        ({"sources": ()}, "no source is named; expected some of true, estimator, encoders"),
        ({"lag": 0.0}, "lag: expected 0.001 to 10, got 0"),
        ({"cutoff": float("nan")}, "cutoff: expected 0.1 to 500, got nan"),
        ({"mismatch": 2.0}, "mismatch: expected 0 to 0.5, got 2"),
    ],
)
def test_impossible_options_are_refused(options, text):
    with pytest.raises(SimulationError) as caught:
        LoopOptions(**options)
    assert str(caught.value) == text


def test_a_time_without_room_for_a_hit_is_refused():
    with pytest.raises(SimulationError, match=r"seconds: one hit takes \d\.\d s, got 1\.5; give more"):
        run_closed_loop(load_robot("doggy"), None, 1.5, 3, options=LoopOptions(("p",), ("true",)))


def test_a_model_of_another_robot_is_refused():
    robot = load_robot("doggy")
    other = replace(robot, joints=("joint1", "joint2"))
    with pytest.raises(
        RobotError, match=r"is no model of doggy: joints: expected joint1, joint2, joint3, got joint1, "
    ):
        run_closed_loop(robot, other, 3.0, 3)


@pytest.mark.slow
def test_motors_that_move_several_joints_track_as_well(tmp_path):
    robot = load_robot("doggy")
    text = robot.path.read_text(encoding="utf-8").replace("urdf: doggy.urdf", f"urdf: {robot.tree.urdf.resolve()}")
    path = tmp_path / "coupled.yaml"
    matrix = "transmission: {matrix: [[1, 0, 0], [0.2, 1, 0], [0, -0.3, 1]]}"
    path.write_text(f"{text}\n{matrix}\n", encoding="utf-8")
    coupled = load_robot(path)
    assert not np.allclose(coupled.transmission, np.eye(3))
    result = run_closed_loop(coupled, None, SECONDS, 3, options=LoopOptions(make_estimator=HoldingEstimator))
    p, feedback = (result.run(controller, "true").tracking for controller in ("p", "state_feedback"))
    assert feedback.link_position_rms < 0.02 * p.link_position_rms
    assert feedback.hit_position < 3e-3  # [m]
