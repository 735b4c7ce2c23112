# SPDX-License-Identifier: BSD-3-Clause
"""The simulator against physics, not against the estimator."""

import argparse
import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from jointscope.robots.errors import EffectError, JointscopeError, RobotError, SimulationError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import add_verb, main
from jointscope.tools.simulator import Disturbance, simulate
from jointscope.tools.simulator.effects import make_effect, simulated_effects
from jointscope.tools.simulator.loop.controller import GAIN
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.effect import SimulatedEffect
from jointscope.tools.simulator.world.engine import TICK, Engine
from jointscope.tools.simulator.world.trajectory import Trajectory

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")

Array = NDArray[np.float64]
BEARING = "bearing_flexibility@joint1"


@pytest.fixture(scope="module")
def doggy() -> Robot:
    return load_robot("doggy")


@pytest.fixture(scope="module")
def truth(doggy):
    return true_robot(doggy, {})


@pytest.fixture(scope="module")
def short(doggy):
    return simulate(doggy, "moves", seconds=4.0, seed=3, quantized=False)


def values(robot: Robot, name: str) -> Array:
    return np.array([robot.parameter(f"{joint}.{name}").value for joint in robot.joints])


def coast(engine: Engine, ticks: int, commands: Array | None = None) -> Trajectory:
    """Runs without controller: given commands, or none."""
    zero = np.zeros((ticks, len(engine.link)))
    commands = zero if commands is None else commands
    return engine.run(lambda k, q: commands[k], zero, zero, lambda done: None)


def drive_torques(robot: Robot, q: Array, v: Array, q_motor: Array, v_motor: Array, u: Array) -> tuple[Array, Array]:
    """tau_c and b dv_motor, straight from the paper's eqs. 6, 7, 11 and 12."""
    tau_c = values(robot, "stiffness") * (q - q_motor) + values(robot, "damping") * (v - v_motor)
    k_pwm, k_mi = robot.parameter("motor.k_pwm").value, robot.parameter("motor.k_mi").value
    friction = values(robot, "coulomb_torque") * np.tanh(robot.choices.friction_sharpness * v_motor)
    return tau_c, tau_c + k_pwm * robot.command_volts * u - k_mi * v_motor - friction


def test_accelerations_equal_those_of_pinocchio_and_the_drive_equations(truth):
    engine, rng = Engine(truth, friction="smooth"), np.random.default_rng(0)
    for _ in range(20):
        q, q_motor = rng.uniform(-1.2, 1.2, (2, 3))
        v, v_motor = rng.uniform(-5, 5, (2, 3))
        v_motor[0] = rng.uniform(-0.01, 0.01)  # inside the transition of the friction
        u = rng.uniform(-1, 1, 3)
        tau_c, torque = drive_torques(truth, q, v, q_motor, v_motor, u)
        state = np.zeros((2, 6))
        state[:, engine.link], state[:, engine.motor] = (q, v), (q_motor, v_motor)
        a = engine.accelerations(*state, u)
        expected = truth.tree.acceleration(q[None], v[None], -tau_c[None])[0]
        np.testing.assert_allclose(a[engine.link], expected, rtol=1e-9, atol=1e-9)
        inertia = truth.parameter("motor.inertia").value
        np.testing.assert_allclose(a[engine.motor], torque / inertia, rtol=1e-9, atol=1e-9)


def test_a_soft_bearing_is_two_sprung_hinges_before_the_joint(truth):
    products = {"product_xy": 0.02, "product_xz": -0.03, "product_yz": 0.05}
    effect = make_effect(f"{BEARING}:" + ",".join(f"{name}={value}" for name, value in products.items()), truth)
    engine, rng = Engine(truth, [effect], "smooth"), np.random.default_rng(1)
    assert engine.coordinates[:3] == ("joint1.bearing_x", "joint1.bearing_y", "joint1")
    model = five_joint_model(truth.tree.model, 2.4, 2.7, products)
    data = model.createData()
    stiffness, damping = np.array([2500.0, 3200.0]), np.array([12.0, 14.0])
    for _ in range(10):
        q, v = rng.uniform(-1, 1, (2, 8))
        q[:2] *= 0.05
        link, motor, u = engine.link, engine.motor, rng.uniform(-1, 1, 3)
        tau_c, _ = drive_torques(truth, q[link], v[link], q[motor], v[motor], u)
        tau = np.concatenate([-stiffness * q[:2] - damping * v[:2], -tau_c])
        expected = pin.aba(model, data, q[:5], v[:5], tau)
        np.testing.assert_allclose(engine.accelerations(q, v, u)[:5], expected, rtol=1e-8, atol=1e-8)


def five_joint_model(chain: pin.Model, inertia_x: float, inertia_y: float, products: dict[str, float]) -> pin.Model:
    """Doggy with hinges x and y before joint 1, built in pinocchio."""
    model = pin.Model()
    model.gravity = pin.Motion.Zero()
    parent = model.addJoint(0, pin.JointModelRX(), chain.jointPlacements[1], "bearing_x")
    parent = model.addJoint(parent, pin.JointModelRY(), pin.SE3.Identity(), "bearing_y")
    for j in range(1, 4):
        placement = chain.jointPlacements[j] if j > 1 else pin.SE3.Identity()
        parent = model.addJoint(parent, chain.joints[j], placement, chain.names[j])
        I = chain.inertias[j].inertia.copy()  # noqa: E741
        if j == 1:
            I[0, 0], I[1, 1] = inertia_x, inertia_y
            for (i, k), value in zip(((0, 1), (0, 2), (1, 2)), products.values(), strict=True):
                I[i, k] = I[k, i] = value
        body = pin.Inertia(chain.inertias[j].mass, chain.inertias[j].lever, I)
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    return model


def test_energy_is_kept_without_friction_damping_and_back_emf(doggy):
    zero = {f"{joint}.{name}": 0.0 for joint, name in product(doggy.joints, ("coulomb_torque", "damping"))}
    robot = true_robot(doggy, {**zero, "motor.k_mi": 0.0})
    engine = Engine(robot)
    engine.place(np.array([0.2, -0.3, 0.4]))
    engine.data.qvel[:] = np.random.default_rng(2).uniform(-2, 2, 6)
    run = coast(engine, 2000)
    q, v, q_motor, v_motor = (
        run.q[:, engine.link],
        run.v[:, engine.link],
        run.q[:, engine.motor],
        run.v[:, engine.motor],
    )
    kinetic = np.einsum("ki,kij,kj->k", v, robot.tree.mass_matrix(q), v) / 2
    rotors = robot.parameter("motor.inertia").value * (v_motor**2).sum(1) / 2
    springs = (values(robot, "stiffness") * (q - q_motor) ** 2).sum(1) / 2
    energy = kinetic + rotors + springs
    assert springs.max() > 0.1 * energy[0]
    assert np.abs(energy / energy[0] - 1).max() < 1e-8


def test_a_link_swings_on_a_heavy_rotor_with_the_frequency_of_its_spring(doggy):
    robot = true_robot(doggy, {"motor.inertia": 1e7, "joint3.damping": 0.0})
    engine = Engine(robot, friction="smooth")
    engine.place(np.zeros(3))
    engine.data.qpos[engine.link[2]] = 1e-3
    q3 = coast(engine, 3000).q[:, engine.link[2]]
    falling = np.flatnonzero((q3[:-1] > 0) & (q3[1:] <= 0))
    crossings = (falling + q3[falling] / (q3[falling] - q3[falling + 1])) * TICK / 5
    omega = 2 * np.pi / np.diff(crossings).mean()
    assert omega == pytest.approx(np.sqrt(103.056 / 0.5142253), rel=1e-4)


@pytest.mark.parametrize("friction", ["dry", "smooth"])
def test_friction_stops_a_free_rotor_with_constant_torque(doggy, friction):
    free = {f"{joint}.stiffness": 1e-9 for joint in doggy.joints} | {f"{joint}.damping": 0.0 for joint in doggy.joints}
    robot = true_robot(doggy, {**free, "motor.k_mi": 0.0})
    engine = Engine(robot, friction=friction)
    engine.place(np.zeros(3))
    engine.data.qvel[engine.motor] = 1.0
    v = coast(engine, 2000).v[:, engine.motor]
    deceleration = values(robot, "coulomb_torque") / robot.parameter("motor.inertia").value
    # One part in 1e4 of the engine's dry friction is soft, see DRY_IMPEDANCE.
    np.testing.assert_allclose((v[0] - v[1000]) / 0.2, deceleration, rtol=2e-4)
    assert np.abs(v[-1]).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "largest"), [("smooth", 1e-5), ("dry", 3e-4)])
def test_half_the_step_gives_the_same_motion_far_below_the_noise_of_the_gyros(doggy, truth, friction, largest):
    recorded = simulate(doggy, seconds=3.0, seed=1, friction=friction)
    commands, runs = recorded.recording.command.values, []
    for steps in (5, 10):
        engine = Engine(truth, [make_effect(BEARING, truth)], friction, steps)
        engine.place(recorded.states[0, :3])
        runs.append(coast(engine, len(commands), commands).v[::steps])
    error = runs[0] - runs[1]
    assert np.abs(error).max() < largest  # [rad/s]
    assert error.std() < 0.02 * doggy.gyros[0].sigma


def test_the_same_seed_gives_the_same_recording_and_another_seed_another(doggy, short):
    again = simulate(doggy, "moves", seconds=4.0, seed=3, quantized=False)
    other = simulate(doggy, "moves", seconds=1.5, seed=4)
    assert again.truth == short.truth
    for name, stream in short.recording.streams.items():
        np.testing.assert_array_equal(stream.values, again.recording.streams[name].values)
        np.testing.assert_array_equal(stream.received, again.recording.streams[name].received)
    assert not np.array_equal(other.states[0], short.states[0])
    assert other.truth["parameters"]["imu1.R_imu_body"] != short.truth["parameters"]["imu1.R_imu_body"]


def test_the_same_seed_with_another_motion_is_the_same_robot_on_another_occasion(doggy, short):
    other = simulate(doggy, "calibration", seconds=1.5, seed=3)
    assert other.truth["parameters"]["imu2.R_imu_body"] == short.truth["parameters"]["imu2.R_imu_body"]
    assert other.truth["parameters"]["imu2.bias"] != short.truth["parameters"]["imu2.bias"]


def test_gyros_measure_the_rate_of_their_body_with_mounting_bias_and_noise(doggy, short):
    q, v = short.states[:, :3], short.states[:, 3:6]
    for gyro in doggy.gyros:
        true = short.truth["parameters"]
        omega_body, _, _ = doggy.tree.body_rate(gyro.body, q, v)
        expected = omega_body @ np.array(true[f"{gyro.name}.R_imu_body"]).T + true[f"{gyro.name}.bias"]
        error = short.recording.streams[gyro.name].values - expected
        np.testing.assert_allclose(error.std(0), gyro.sigma, rtol=0.05)
        assert np.abs(error.mean(0)).max() < 4 * gyro.sigma / np.sqrt(len(error))
        angle = np.arccos((np.trace(np.array(true[f"{gyro.name}.R_imu_body"]) @ gyro.R_imu_body.T) - 1) / 2)
        assert 0 < angle < np.deg2rad(10)


@pytest.mark.parametrize("quantized", [True, False])
def test_encoders_have_the_sigma_of_the_robot_file(doggy, quantized):
    simulation = simulate(doggy, seconds=6.0, seed=5, quantized=quantized)
    moving = np.abs(simulation.states[:, 9:12]).min(1) > 0.05
    error = simulation.recording.streams["motor_encoder"].values - simulation.states[:, 6:9]
    assert error[moving].std() == pytest.approx(doggy.motor_encoder.sigmas[0], rel=0.05)
    steps = np.unique(np.round(np.diff(np.unique(simulation.recording.streams["motor_encoder"].values[:, 0])), 9))
    assert (steps.min() > 1e-4) == quantized


def test_the_controller_reads_what_the_recording_holds_and_keeps_its_limits(doggy):
    simulation = simulate(doggy, seconds=8.0, seed=6)
    u, t = simulation.recording.command.values, simulation.state_times
    assert not u[t < 0.5].any()
    assert np.abs(u[t < 3.5]).max() == pytest.approx(0.15)
    assert np.abs(u).max() == pytest.approx(0.9)
    target = u / GAIN + simulation.recording.streams["motor_encoder"].values
    free = (np.abs(u[:-1]) < 0.14) & (np.abs(u[1:]) < 0.14) & (t[1:, None] > 0.6) & (t[1:, None] < 3.5)
    jumps = np.abs(np.diff(target, axis=0))[free]
    assert free.sum() > 500 and np.mean(jumps < 1e-9) > 0.99  # the target is constant between jumps


def test_a_jittered_sample_carries_the_value_of_its_own_time(doggy):
    simulation = simulate(doggy, "moves", seconds=3.0, seed=7, jitter=2e-4, quantized=False)
    stream, t = simulation.recording.streams["motor_encoder"], simulation.state_times
    assert (stream.times - t).std() == pytest.approx(2e-4, rel=0.1)
    inside = slice(1, -1)
    at_stamp = np.column_stack([np.interp(stream.times, t, simulation.states[:, k]) for k in (6, 7, 8)])
    assert (stream.values - at_stamp)[inside].std() == pytest.approx(doggy.motor_encoder.sigmas[0], rel=0.1)
    assert (stream.values - simulation.states[:, 6:9])[inside].std() > 2 * doggy.motor_encoder.sigmas[0]
    assert not np.array_equal(stream.times, simulation.recording.streams["imu1"].times)


def test_rates_and_drop_outs(doggy):
    simulation = simulate(doggy, seconds=2.0, seed=8, encoder_rate=500.0, gyro_rate=1600.0, drop=0.1)
    streams = simulation.recording.streams
    assert len(streams["command"]) == 2000
    assert len(streams["motor_encoder"]) == pytest.approx(900, abs=40)
    assert len(streams["imu1"]) == pytest.approx(2880, abs=80)
    for stream in streams.values():
        assert np.all(np.diff(stream.times) > 0) and np.all(stream.received > stream.times)
        assert stream.values.shape == (len(stream), len(stream.channels))


def test_trajectory_is_exact_on_its_grid_and_smooth_between():
    t = np.arange(501) * 2e-4
    run = Trajectory(2e-4, np.sin(20 * t)[:, None], 20 * np.cos(20 * t)[:, None])
    q, v = run.at(t)
    np.testing.assert_array_equal(q, run.q)
    np.testing.assert_array_equal(v, run.v)
    between = np.random.default_rng(9).uniform(0, run.end, 200)
    q, v = run.at(between)
    np.testing.assert_allclose(q[:, 0], np.sin(20 * between), atol=1e-12)
    np.testing.assert_allclose(v[:, 0], 20 * np.cos(20 * between), atol=1e-7)


def test_disturbances_have_the_asked_size_and_correlation():
    rng = np.random.default_rng(10)
    link, motor = Disturbance(0.5, 0.2, 0.02).torques(rng, 50_000, 3, TICK)
    assert link.std() == pytest.approx(0.5, rel=0.05)
    assert motor.std() == pytest.approx(0.2, rel=0.05)
    assert np.mean(link[1:] * link[:-1]) / link.var() == pytest.approx(np.exp(-0.05), abs=0.01)
    white, _ = Disturbance(link=0.5).torques(rng, 50_000, 3, TICK)
    assert abs(np.mean(white[1:] * white[:-1])) / white.var() < 0.02
    assert Disturbance.parse("link=0.5,correlation_time=0.02") == Disturbance(0.5, 0.0, 0.02)


def test_a_softer_bearing_tilts_in_proportion(doggy):
    tilts = []
    for softness in (1, 2):
        effect = f"{BEARING}:compliance_x={softness * 2e-5},compliance_y={softness * 2e-5}"
        extra = simulate(doggy, "moves", seconds=4.0, seed=11, effects=[effect]).extra_states
        tilts.append([extra[f"joint1.bearing_{axis}"][:, 0].std() for axis in "xy"])
    np.testing.assert_allclose(np.array(tilts[1]) / tilts[0], 2.0, rtol=0.05)


def test_a_rigid_bearing_is_no_bearing(doggy):
    rigid = simulate(doggy, seconds=1.5, effects=[f"{BEARING}:compliance_x=0,compliance_y=0"])
    assert rigid.extra_states == {}
    np.testing.assert_allclose(rigid.states, simulate(doggy, seconds=1.5).states, atol=1e-9)


def test_truth_holds_everything_by_full_name_and_survives_json(doggy):
    simulation = simulate(doggy, seconds=1.0, seed=2, parameters={"joint1.stiffness": 180.0}, effects=[BEARING])
    truth = json.loads(json.dumps(simulation.truth))
    assert truth == simulation.truth
    assert truth["parameters"]["joint1.stiffness"] == 180.0
    assert truth["parameters"]["motor.k_pwm"] == 4.696  # Table 1, not the start value of the robot file
    assert truth["parameters"]["joint1.bearing_flexibility.compliance_x"] == 1 / 2500
    assert np.shape(truth["parameters"]["imu2.R_imu_body"]) == (3, 3)
    assert (truth["effects"][0]["effect"], truth["effects"][0]["owner"]) == ("bearing_flexibility", "joint1")
    assert (truth["seed"], truth["motion"], truth["seconds"], truth["friction"]) == (2, "calibration", 1.0, "dry")
    assert tuple(simulation.recording.streams) == ("command", *doggy.sensors)


class HalfCommand(SimulatedEffect):
    """Halves the command, doubles the encoders, delays the gyros by one tick and pulls on the first link."""

    id, acts_on, defaults = "half_command", ("robot",), {"torque": 1.5}

    def bind(self, model, data, address):
        self.passive, self.dof = data.qfrc_passive, address.link["joint1"]

    def command(self, time, issued):
        return 0.5 * issued

    def torque(self):
        self.passive[self.dof] += self.parameters["torque"]

    def taken_at(self, sensor, stamps):
        return stamps - TICK if sensor.name == "imu1" else stamps

    def reading(self, sensor, stamps, values):
        return 2.0 * values if sensor.name == "motor_encoder" else values


def test_every_hook_of_an_effect_takes_part(doggy, truth, monkeypatch):
    monkeypatch.setitem(simulated_effects(), "half_command", HalfCommand)
    engine = Engine(truth, [HalfCommand("robot", {}, truth)], "smooth")
    still = np.zeros(6)
    with_torque, without = (e.accelerations(still, still, np.zeros(3)) for e in (engine, Engine(truth, (), "smooth")))
    a = (with_torque - without)[engine.link]
    assert a @ truth.tree.mass_matrix(np.zeros((1, 3)))[0] == pytest.approx([1.5, 0, 0], abs=1e-9)
    engine.place(np.zeros(3))
    coast(engine, 1, np.full((1, 3), 0.4))
    np.testing.assert_allclose(engine.data.ctrl, 0.2)
    gyros = {name: replace(g, sigma=1e-12) for name, g in doggy.sensors.items() if name.startswith("imu")}
    simulation = simulate(doggy.with_sensors(gyros), "moves", seconds=2.0, effects=["half_command@robot"])
    encoder = simulation.recording.streams["motor_encoder"].values
    np.testing.assert_allclose(encoder, 2 * simulation.states[:, 6:9], atol=5e-4)
    omega, _, _ = doggy.tree.body_rate("link1", simulation.states[:, :3], simulation.states[:, 3:6])
    R, bias = (np.array(simulation.truth["parameters"][f"imu1.{x}"]) for x in ("R_imu_body", "bias"))
    np.testing.assert_allclose(simulation.recording.streams["imu1"].values[1:], (omega @ R.T + bias)[:-1], atol=1e-9)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"effects": ["foo@joint1"]}, EffectError, "effect 'foo' cannot be simulated; known are .*bearing_flexibility"),
        ({"effects": ["bearing_flexibility@imu1"]}, EffectError, "cannot act on 'imu1'; it acts on joint1, joint2"),
        ({"effects": [f"{BEARING}:k=1"]}, EffectError, "has no parameter 'k'; it has compliance_x"),
        ({"effects": [f"{BEARING}:damping_x=-1"]}, EffectError, "damping_x must not be negative, got -1"),
        ({"parameters": {"joint9.stiffness": 1.0}}, RobotError, "no parameter 'joint9.stiffness'"),
        ({"parameters": {"joint1.stiffness": 1e9}}, SimulationError, "diverged before"),
        ({"parameters": {"joint1.stiffness": float("nan")}}, SimulationError, "cannot be simulated with nan"),
        ({"motion": "dance"}, SimulationError, "unknown motion 'dance'; expected calibration or moves"),
        ({"friction": "wet"}, SimulationError, "unknown friction 'wet'; expected dry or smooth"),
        ({"seconds": 0.1}, SimulationError, "seconds: expected 1 s to one day, got 0.1"),
        ({"drop": 2.0}, SimulationError, "drop: expected a probability of 0 to 0.95, got 2"),
    ],
)
def test_impossible_wishes_are_refused_with_a_reason(doggy, options, error, message):
    with pytest.raises(error, match=message):
        simulate(doggy, **{"seconds": 1.0, **options})


def test_without_mujoco_the_message_says_what_to_install(doggy, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(SimulationError, match=r"pip install 'jointscope\[sim\]'"):
        simulate(doggy, seconds=1.0)


def verb(*words: str) -> int:
    parser = argparse.ArgumentParser()
    add_verb(parser.add_subparsers(), "simulate")
    arguments = parser.parse_args(["simulate", *words])
    return arguments.run(arguments)


def test_the_verb_writes_a_bag_that_can_be_read_and_the_truth_beside_it(doggy, tmp_path, capsys):
    bag, summary = tmp_path / "train.mcap", tmp_path / "out.json"
    options = ["--seconds", "1.5", "--seed", "4", "--effect", BEARING, "--set", "joint1.stiffness=180"]
    assert verb("doggy", "-o", str(bag), "--json", str(summary), "--jitter", "0.1", *options) == 0
    expected = simulate(
        doggy, seconds=1.5, seed=4, effects=[BEARING], parameters={"joint1.stiffness": 180.0}, jitter=1e-4
    )
    assert json.loads((tmp_path / "train.truth.json").read_text()) == expected.truth
    assert json.loads(summary.read_text())["samples"] == {s: 1500 for s in expected.recording.streams}
    assert "motion calibration, seed 4, dry friction" in capsys.readouterr().out
    recording = read_recording(bag, doggy)
    for name, stream in expected.recording.streams.items():
        np.testing.assert_allclose(recording.streams[name].values, stream.values, atol=1e-12)
        np.testing.assert_allclose(np.diff(recording.streams[name].times), np.diff(stream.times), atol=3e-9)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.json", "train.mcap", "train.truth.json"]


def test_the_verb_says_which_effects_of_the_robot_file_it_does_not_simulate(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["add", "doggy", "cogging@joint1", "-o", "rippled.yaml"]) == 0
    capsys.readouterr()
    assert verb("rippled.yaml", "-o", "a.mcap", "--seconds", "1", "--json", "a.json") == 0
    told = "not simulated, although in the robot file: cogging@joint1; name them: "
    (line,) = [line.strip() for line in capsys.readouterr().out.splitlines() if "although" in line]
    assert line.startswith(told)
    assert verb("rippled.yaml", "-o", "c.mcap", "--seconds", "1", *line.removeprefix(told).split()) == 0
    assert "not simulated" not in capsys.readouterr().out
    assert json.loads(Path("a.json").read_text())["not_simulated"] == ["cogging@joint1"]
    assert verb("rippled.yaml", "-o", "b.mcap", "--seconds", "1", "--effect", "cogging@joint1") == 0
    assert "not simulated" not in capsys.readouterr().out


def test_the_verb_advises_no_option_that_it_refuses(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    effects = "cogging@joint1", "spring_pieces_1@joint2", "encoder_hysteresis@joint3", "load_scale@robot"
    assert main(["add", "doggy", *effects, "-o", "many.yaml"]) == 0
    capsys.readouterr()
    assert verb("many.yaml", "-o", "a.mcap", "--seconds", "1", "--json", "a.json") == 0
    told = [line.strip() for line in capsys.readouterr().out.splitlines()[-3:]]
    head, options = told[0].split("; name them: ")
    assert head == f"not simulated, although in the robot file: {', '.join(effects)}"
    assert told[1].startswith("cannot be simulated: spring_pieces_1@joint2: a real spring has no knots; simulate ")
    assert told[2].startswith("cannot be simulated: load_scale@robot: no loads hang on ")
    assert verb("many.yaml", "-o", "b.mcap", "--seconds", "1", *options.split()) == 0
    assert (
        "not simulated, although in the robot file: spring_pieces_1@joint2, load_scale@robot\n"
        in capsys.readouterr().out
    )
    assert set(json.loads(Path("a.json").read_text())["cannot_be_simulated"]) == {effects[1], effects[3]}


def test_the_verb_leaves_nothing_behind_when_it_fails(tmp_path):
    with pytest.raises(JointscopeError, match=r"train.mcap: the folder .*nowhere does not exist"):
        verb("doggy", "-o", str(tmp_path / "nowhere" / "train.mcap"))
    with pytest.raises(SimulationError, match=r"--set joint1\.stiffness: expected NAME=VALUE"):
        verb("doggy", "-o", str(tmp_path / "train.mcap"), "--set", "joint1.stiffness")
    with pytest.raises(SimulationError, match="disturbance: unknown 'lnk'; expected link, motor, correlation_time"):
        verb("doggy", "-o", str(tmp_path / "train.mcap"), "--disturbance", "lnk=1")
    assert not list(tmp_path.iterdir())
