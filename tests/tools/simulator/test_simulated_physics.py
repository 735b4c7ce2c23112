# SPDX-License-Identifier: BSD-3-Clause
"""Simulated effects of the mechanics and the drives against torques and motions worked out by other means."""

import numpy as np
import pinocchio as pin
import pytest

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator import simulate
from jointscope.tools.simulator.effects import make_effect
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.engine import TICK, Engine
from jointscope.tools.simulator.world.trajectory import Trajectory

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

DOGGY = load_robot("doggy")
TRUTH = true_robot(DOGGY, {})
K = np.array([TRUTH.parameter(f"{joint}.stiffness").value for joint in TRUTH.joints])
D = np.array([TRUTH.parameter(f"{joint}.damping").value for joint in TRUTH.joints])
MU = np.array([TRUTH.parameter(f"{joint}.coulomb_torque").value for joint in TRUTH.joints])
LOOSE = {f"{joint}.stiffness": 1e-9 for joint in DOGGY.joints} | {f"{joint}.damping": 0.0 for joint in DOGGY.joints}
VOLTS = TRUTH.parameter("motor.k_pwm").value * TRUTH.command_volts  # [N m] of the full command


def coast(engine: Engine, ticks: int, command: np.ndarray | None = None) -> Trajectory:
    zero = np.zeros((ticks, 3))
    return engine.run(lambda k, q: zero[k] if command is None else command, zero, zero, lambda done: None)


def added_torques(text: str, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Torques on links and rotors that an effect adds, from accelerations with and without it; state (4, 3)."""
    q, v, q_motor, v_motor = state
    with_effect, without = Engine(TRUTH, [make_effect(text, TRUTH)], "smooth"), Engine(TRUTH, (), "smooth")
    a = []
    for engine in (with_effect, without):
        x = np.zeros((2, 6))
        x[:, engine.link], x[:, engine.motor] = (q, v), (q_motor, v_motor)
        a.append(engine.accelerations(*x, np.array([0.1, -0.2, 0.3])))
    change = a[0] - a[1]
    mass = TRUTH.tree.mass_matrix(q[None])[0]
    return mass @ change[without.link], TRUTH.parameter("motor.inertia").value * change[without.motor]


def tanh(v):
    return np.tanh(200.0 * v)


# What an effect of joint 2 adds to (link torques, rotor torques), for q, v, q_motor, v_motor, each of shape (3,).
LAWS = {
    "link_viscous": (lambda q, v, p, w: -1.0 * v[1], None),
    "link_coulomb": (lambda q, v, p, w: -0.8 * tanh(v[1]), None),
    "parallel_spring": (lambda q, v, p, w: 0.5 - 2.0 * q[1], None),
    "gravity_imbalance": (lambda q, v, p, w: 1.8 * np.cos(q[1]) + 2.4 * np.sin(q[1]), None),
    "motor_viscous": (None, lambda q, v, p, w: -2.0 * w[1]),
    "quadratic_damping": (None, lambda q, v, p, w: -1.0 * w[1] * abs(w[1])),
    "motor_stribeck": (None, lambda q, v, p, w: -1.5 * np.exp(-((w[1] / 0.1) ** 2)) * tanh(w[1])),
    "load_dependent_friction": (
        None,
        lambda q, v, p, w: -0.25 * abs(K[1] * (q[1] - p[1]) + D[1] * (v[1] - w[1])) * tanh(w[1]),
    ),
    "asymmetric_friction": (None, lambda q, v, p, w: -0.6 * tanh(w[1]) ** 2),
    "cogging": (None, lambda q, v, p, w: 0.48 * np.cos(42.092 * p[1]) + 0.64 * np.sin(42.092 * p[1])),
    "torque_offset": (None, lambda q, v, p, w: 1.0),
}
SPRING_LAWS = {  # torque that joins the spring's: minus on the link, plus on the rotor; of deflection and its rate
    "spring_cubic": lambda d, rate: 20000.0 * d**3,
    "spring_curve": lambda d, rate: 600.0 * d**2 + 20000.0 * d**3,
    "backlash": lambda d, rate: -K[1] * np.clip(d, -0.012, 0.012) - D[1] * rate * (abs(d) < 0.012),
    "spring_limit": lambda d, rate: 800.0 * (max(d - 0.02, 0.0) + min(d + 0.03, 0.0)),
    "spring_ropes": lambda d, rate: 150.0 * max(d - 0.005, 0.0) + 400.0 * min(d + 0.015, 0.0),
    "spring_slack": lambda d, rate: -K[1] * np.clip(d, 0.0, 0.03) - D[1] * rate * (0.0 < d < 0.03),
}


def random_state(seed: int) -> np.ndarray:
    state = np.random.default_rng(seed).uniform(-0.8, 0.8, (4, 3))
    state[2] = state[0] + 0.03 * state[2]  # deflections as they are
    state[3, 1] *= 0.05 if seed % 2 else 1.0  # also within the transition of the friction
    return state


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("effect_id", [*LAWS, *SPRING_LAWS])
def test_torques_are_those_of_the_catalogue(effect_id, seed):
    state = random_state(seed)
    if effect_id in LAWS:
        on_link, on_rotor = (law(*state) if law else 0.0 for law in LAWS[effect_id])
    else:
        spring = SPRING_LAWS[effect_id](state[0, 1] - state[2, 1], state[1, 1] - state[3, 1])
        on_link, on_rotor = -spring, spring
    link, rotor = added_torques(f"{effect_id}@joint2", state)
    np.testing.assert_allclose(link, [0.0, on_link, 0.0], atol=1e-9)
    np.testing.assert_allclose(rotor, [0.0, on_rotor, 0.0], atol=1e-9)


def test_a_coupled_spring_pulls_on_the_joint_that_it_is_coupled_to():
    state = random_state(5)
    link, rotor = added_torques("kinematic_coupling@joint3:from_joint1=0.02,from_joint2=-0.05", state)
    ratios = np.array([0.02, -0.05, -1.0])  # deflection = q3 - q_motor3 - 0.02 q1 + 0.05 q2
    before = K[2] * (state[0, 2] - state[2, 2]) + D[2] * (state[1, 2] - state[3, 2])
    after = -K[2] * (ratios @ state[0] + state[2, 2]) - D[2] * (ratios @ state[1] + state[3, 2])
    np.testing.assert_allclose(link, ratios * after - np.array([0, 0, -before]), atol=1e-9)
    np.testing.assert_allclose(rotor, [0.0, 0.0, after - before], atol=1e-9)


def chain_with(joint: int, inertia: pin.Inertia) -> pin.Model:
    model = TRUTH.tree.model.copy()
    model.gravity = pin.Motion.Zero()
    model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    return model


MORE_INERTIA = {
    "payload@joint3:inertia=0.05": (3, pin.Inertia(0.2, np.array([0.0, 0.0, 0.5]), np.zeros((3, 3)))),
    "inertia_error@joint2:ixx=0.002,iyy=0.001,izz=0.0015": (
        2,
        pin.Inertia(0.0, np.zeros(3), np.diag([0.002, 0.001, 0.0015])),
    ),
}


@pytest.mark.parametrize("text", list(MORE_INERTIA))
def test_more_inertia_accelerates_as_in_pinocchio(text):
    model = chain_with(*MORE_INERTIA[text])
    engine, state = Engine(TRUTH, [make_effect(text, TRUTH)], "smooth"), random_state(4)
    q, v, q_motor, v_motor = state
    x = np.zeros((2, 6))
    x[:, engine.link], x[:, engine.motor] = (q, v), (q_motor, v_motor)
    tau_c = K * (q - q_motor) + D * (v - v_motor)
    expected = pin.aba(model, model.createData(), q, v, -tau_c)
    # The long axis of the last body is half a milliradian off the axis z of its joint.
    np.testing.assert_allclose(engine.accelerations(*x, np.zeros(3))[engine.link], expected, rtol=1e-3, atol=1e-3)


def free_rotors(*effects: str, friction: str = "dry", **parameters: float) -> Engine:
    """Rotors without springs and back-EMF."""
    robot = true_robot(DOGGY, {**LOOSE, "motor.k_mi": 0.0, **parameters})
    engine = Engine(robot, [make_effect(text, robot) for text in effects], friction)
    engine.place(np.full(3, 0.2))
    return engine


@pytest.mark.parametrize(
    ("effect", "extra"),
    [("motor_stribeck@joint2", 1.5), ("position_dependent_friction@joint2", 2.5), ("warming_friction@joint2", 2.0)],
)
def test_a_rotor_with_dry_friction_sticks_up_to_the_friction_that_there_is(effect, extra):
    for share, moves in ((0.95, False), (1.05, True)):
        engine = free_rotors(effect)
        push = np.array([0.0, share * (MU[1] + extra) / VOLTS, 0.0])
        travel = np.abs(coast(engine, 300, push).q[:, engine.motor[1]] - 0.2).max()
        assert (travel > 1e-3) == moves


def test_dry_and_smooth_friction_brake_a_fast_rotor_alike():
    for text in ("motor_stribeck@joint2:velocity=3", "asymmetric_friction@joint2", "warming_friction@joint2"):
        speeds = []
        for friction in ("dry", "smooth"):
            engine = free_rotors(text, friction=friction)
            engine.data.qvel[engine.motor] = 1.0
            speeds.append(coast(engine, 150).v[-1, engine.motor[1]])
        assert 0.5 < speeds[0] < 1.0 - 0.15 * MU[1] / 2.428
        assert speeds[0] == pytest.approx(speeds[1], abs=2e-4)


def test_a_warm_rotor_has_the_friction_of_the_robot_file():
    engine = free_rotors("warming_friction@joint2:torque=2,time_constant=0.02")
    engine.data.qvel[engine.motor] = 1.0
    v = coast(engine, 400).v[:, engine.motor[1]]
    assert (v[1500] - v[1900]) / 0.08 == pytest.approx(MU[1] / 2.428, rel=1e-3)
    lost = 1.0 - v[1000] - 0.2 * MU[1] / 2.428
    assert lost == pytest.approx(2.0 * 0.02 / 2.428, rel=1e-3)  # the integral of the decaying torque


def test_a_link_crosses_the_free_play_at_constant_speed_and_turns_at_its_edge():
    robot = true_robot(DOGGY, {"motor.inertia": 1e7, "joint3.damping": 0.0})
    engine = Engine(robot, [make_effect("backlash@joint3:half_gap=0.02", robot)], "smooth")
    engine.place(np.zeros(3))
    engine.data.qvel[engine.link[2]] = 0.1
    run = coast(engine, 1000)
    q, v = run.q[:, engine.link[2]], run.v[:, engine.link[2]]
    inside = np.abs(q) < 0.0199
    np.testing.assert_allclose(np.abs(v[inside]), 0.1, rtol=1e-6)
    assert q.max() == pytest.approx(0.02 + 0.1 / np.sqrt(103.056 / 0.5142253), rel=1e-4)


def test_the_damper_rests_within_the_free_play_and_takes_energy_beyond_it():
    robot = true_robot(DOGGY, {"motor.inertia": 1e7})
    engine = Engine(robot, [make_effect("backlash@joint3:half_gap=0.02", robot)], "smooth")
    engine.place(np.zeros(3))
    engine.data.qvel[engine.link[2]] = 0.1
    run = coast(engine, 600)
    q, v = run.q[:, engine.link[2]], run.v[:, engine.link[2]]
    leaves, returns = np.flatnonzero(np.diff(np.abs(q) < 0.02)) + 1
    np.testing.assert_allclose(v[:leaves], 0.1, rtol=1e-6)
    assert -0.05 < v[-1] < -0.01
    np.testing.assert_allclose(v[returns + 1 :], v[-1], rtol=1e-6)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_friction_of_a_loaded_gear_knows_the_damper_of_a_gear_with_play(order):
    texts = ["backlash@joint2:half_gap=0", "load_dependent_friction@joint2"]
    state, found = random_state(0), []
    for chosen in ([texts[i] for i in order], texts[1:]):
        engine = Engine(TRUTH, [make_effect(text, TRUTH) for text in chosen], "smooth")
        x = np.zeros((2, 6))
        x[:, engine.link], x[:, engine.motor] = state[:2], state[2:]
        found.append(engine.accelerations(*x, np.zeros(3)))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_hysteresis_takes_from_each_swing_what_its_loop_encloses():
    robot = true_robot(DOGGY, {"motor.inertia": 1e7, "joint3.damping": 0.0})
    engine = Engine(robot, [make_effect("hysteresis@joint3", robot)], "smooth")
    engine.place(np.zeros(3))
    engine.data.qpos[engine.link[2]] = 0.5
    q = coast(engine, 1500).q[:, engine.link[2]]
    peaks = np.abs(q[1:-1][(np.diff(q)[:-1] * np.diff(q)[1:]) < 0])
    # K (A0^2 - A1^2)/2 = T (A0 + A1) - 2 T delta: the way back to saturation costs less.
    expected = 2 * 3.0 / 103.056 * (1.0 - 2 * 0.01 / (peaks[:-1] + peaks[1:]))
    np.testing.assert_allclose(-np.diff(peaks)[2:5], expected[2:5], rtol=0.01)


def test_a_joint_stop_pushes_back_only_beyond_its_angle():
    for angle, torque in ((0.44, 0.0), (0.55, -6.0), (-0.65, 12.0)):
        state = np.zeros((4, 3))
        state[[0, 2], 1] = angle
        link, _ = added_torques("joint_stop@joint2", state)
        np.testing.assert_allclose(link, [0.0, torque, 0.0], atol=1e-9)


def test_a_tool_swings_with_its_own_frequency_on_a_body_that_stands_still():
    robot = true_robot(DOGGY, {"motor.inertia": 1e7})
    text = "swinging_tool@joint3:mass=1e-4,frequency=4,damping_ratio=0"
    engine = Engine(robot, [make_effect(text, robot)], "smooth")
    engine.place(np.zeros(3))
    tool = engine.coordinates.index("joint3.tool_x")
    engine.data.qpos[tool] = 1e-3
    q = coast(engine, 1000).q[:, tool]
    falling = np.flatnonzero((q[:-1] > 0) & (q[1:] <= 0))
    assert 1.0 / (np.diff(falling).mean() * TICK / 5) == pytest.approx(4.0, rel=2e-3)


def test_a_lagging_drive_reaches_63_percent_after_its_time_constant():
    engine = free_rotors(
        "motor_lag@robot:time_constant=0.02", friction="smooth", **{f"joint{i}.coulomb_torque": 0.0 for i in (1, 2, 3)}
    )
    v = coast(engine, 300, np.full(3, 0.1)).v[:, engine.motor[0]]
    a = np.diff(v) / (TICK / 5) / (0.1 * VOLTS / 2.428)
    t = (np.arange(len(a)) + 0.5) * TICK / 5
    np.testing.assert_allclose(a, 1.0 - np.exp(-t / 0.02), atol=1e-4)


@pytest.mark.parametrize("delay", [1e-3, 2.37e-3, 1e-4])
def test_delayed_commands_give_the_same_motion_later(delay):
    push = np.array([0.3, -0.2, 0.1])
    runs = []
    for effects in ((), (make_effect(f"command_delay@robot:delay={delay}", TRUTH),)):
        engine = Engine(TRUTH, effects, "smooth")
        engine.place(np.zeros(3))
        runs.append(coast(engine, 100, push))
    t = np.linspace(0.01, 0.1, 50)
    late = runs[0].at(t - delay)
    np.testing.assert_allclose(runs[1].at(t)[0], late[0], atol=1e-6)
    np.testing.assert_allclose(runs[1].at(t)[1], late[1], atol=2e-5)


def test_a_dead_band_and_a_sagging_supply_take_their_part_of_the_command():
    acting = []
    for text in ("pwm_deadband@joint2:width=0.05", "supply_sag@robot:drop=0.3"):
        effect = make_effect(text, TRUTH)
        acting.append(effect.command(0.0, np.array([0.04, -0.2, 0.66])))
    np.testing.assert_allclose(acting[0], [0.04, -0.15, 0.66])
    np.testing.assert_allclose(acting[1], 0.91 * np.array([0.04, -0.2, 0.66]))


def test_a_robot_under_load_has_settled_when_the_recording_begins():
    for robot, text in ((DOGGY, "gravity_imbalance@joint3"), (DOGGY, "kinematic_coupling@joint3:from_joint2=0.2")):
        simulation = simulate(robot, "moves", 1.5, 5, effects=[text])
        rest = simulation.state_times < 0.5
        assert np.abs(simulation.states[rest][:, 3:6]).max() < 5e-4
        deflection = simulation.states[0, 2] - simulation.states[0, 8]
        assert abs(deflection) > 1e-3
