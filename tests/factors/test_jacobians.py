# SPDX-License-Identifier: BSD-3-Clause
"""One finite-difference test for the Jacobians of every factor, and GTSAM's own check of the wrapped ones."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import gtsam
import numpy as np
import pytest

from jointscope.factors.accelerated import AcceleratedFactor
from jointscope.factors.bias_at_rest import BiasAtRestFactor
from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.euler_dynamics import EulerDynamics
from jointscope.factors.gyro import GyroFactor
from jointscope.factors.initial_state import InitialStateFactor
from jointscope.factors.interpolated import InterpolatedFactor
from jointscope.factors.link_encoder import LinkEncoderFactor
from jointscope.factors.midpoint_dynamics import MidpointDynamics
from jointscope.factors.motor_encoder import MotorEncoderFactor
from jointscope.factors.priors import BiasPrior, DynamicsPrior, RotationPrior
from jointscope.factors.relative_gyro import RelativeGyroFactor
from jointscope.factors.simpson_dynamics import SimpsonDynamics
from jointscope.factors.single import insert_calibration, single_factor, state_key
from jointscope.factors.some_channels import SomeChannels
from jointscope.factors.step import Steps
from jointscope.factors.vertical_gyro import VerticalGyroFactor
from jointscope.graphs.problem.sensor_placement import factor_on_state
from jointscope.robots.bodies.rigid_tree import RigidTree
from jointscope.robots.dynamics.command_path import CommandPath
from jointscope.robots.dynamics.elastic_joints import ElasticJoints
from jointscope.robots.effect_kinds.reading_effect import ReadingEffect
from jointscope.robots.effect_kinds.smoothed_reading import SmoothedReading
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.robots.files.effect_editing import add_effect, carried_noise
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.lateness import Lateness, late_channels
from jointscope.robots.parts.parameter import Parameter
from jointscope.robots.parts.sensors import Accelerometer, LinkEncoder

ROBOT = load_robot("doggy")
MIMICKING = Path(__file__).parents[1] / "graphs/mimicking_doggy.urdf"
PAPER = load_robot("doggy_paper")
M = 5
ROUNDING = 2e-5  # a residual of size 0.3 differenced at 1e-6 keeps 6e-11 of noise, 3e-6 of this


def _factors():
    rng = np.random.default_rng(1)
    imu1, imu2 = ROBOT.gyros
    tree, layout = ROBOT.tree, ROBOT.layout
    rates, other = rng.normal(size=(M, 3)), rng.normal(size=(M, 3))
    fraction, h = rng.uniform(size=M), rng.uniform(5e-4, 2e-3, size=M)
    weight = ROBOT.tree.mass_matrix(rng.normal(size=(M, 3)))
    u = rng.uniform(-1, 1, (M, 3))
    steps = {
        "doggy": Steps(h, u, ROBOT.noise, ROBOT.layout, weight),
        "doggy_paper": Steps(h, u, PAPER.noise, PAPER.layout),
    }
    encoder = MotorEncoderFactor(ROBOT.motor_encoder, rng.normal(size=(M, 3)), layout)
    gyro = GyroFactor(imu2, rates, tree, layout)
    yield "encoder", encoder
    links = LinkEncoder("links", ROBOT.motor_encoder.source, np.full(ROBOT.n, 1e-4), rng.normal(size=3), ROBOT.joints)
    yield "link encoder", LinkEncoderFactor(links, rng.normal(size=(M, 3)), layout)
    yield "gyro on the first body", GyroFactor(imu1, rates, tree, layout)
    yield "gyro on the last body", gyro
    yield "vertical gyro", VerticalGyroFactor(imu1, rates, tree, layout)
    yield "relative gyro", RelativeGyroFactor(imu2, rates, tree, layout, imu1, other)
    yield "bias at rest", BiasAtRestFactor(imu1, rates)
    yield "interpolated encoder", InterpolatedFactor(encoder, fraction, h, layout)
    yield "interpolated gyro", InterpolatedFactor(gyro, fraction, h, layout)
    yield "initial state", InitialStateFactor(layout, 0.1, 1e-3)
    yield "dynamics prior", DynamicsPrior.of(ROBOT)
    yield "bias prior", BiasPrior(imu1)
    yield "rotation prior", RotationPrior(imu2)
    for robot in (ROBOT, PAPER):
        for kind in (EulerDynamics, MidpointDynamics, SimpsonDynamics):
            yield f"{kind.__name__} {robot.name}", kind(ElasticJoints(robot), steps[robot.name], robot.joints)


def _robots_with_effects():
    """Every effect of the catalogue at its last owner, at its example size."""
    base = {"": ROBOT, "coriolis": replace(ROBOT, choices=replace(ROBOT.choices, coriolis=False))}
    base["coriolis"] = replace(base["coriolis"], tree=ROBOT.tree.with_coriolis(False))
    base["joint_elasticity"] = replace(ROBOT, choices=replace(ROBOT.choices, rigid_joints=("joint3",)))
    base["joint_elasticity"] = replace(base["joint_elasticity"], noise=carried_noise(ROBOT, base["joint_elasticity"]))
    known = replace(ROBOT.parameters["motor.k_pwm"], fixed=True)
    base["torque_constant_error"] = replace(ROBOT, parameters={**ROBOT.parameters, known.name: known})
    heavy = RigidTree(MIMICKING, ROBOT.joints, np.array([1.0, -2.0, -9.0]), locked={"ear": 0.7})
    base["gravity_direction"] = base["weight_dependent_friction"] = replace(ROBOT, tree=heavy)
    base["axis_misalignment"] = replace(ROBOT, tree=heavy, sensors={ROBOT.motor_encoder.name: ROBOT.motor_encoder})
    for effect in catalogue().values():
        if effect.id == "integration_error":
            continue
        robot = base.get(effect.id, ROBOT)
        owner = effect.owners_of(robot)[-1]
        yield f"{effect.id}@{owner}", add_effect(robot, f"{effect.id}@{owner}", dict(effect.example))
    yield "rigid joint", base["joint_elasticity"]
    for label, robot in (("torques that last", ROBOT), ("lasting torques, rigid joint", base["joint_elasticity"])):
        sigma = np.ones(robot.layout.n_link + robot.layout.n_motor)
        yield label, replace(robot, noise=robot.noise.with_lasting(0.02, sigma))


def _factors_with_effects():
    """The dynamics, and the sensors where an effect concerns them."""
    for label, robot in _robots_with_effects():
        rng = np.random.default_rng(5)
        h, u = rng.uniform(5e-4, 2e-3, size=M), rng.uniform(-1, 1, (M, 3))
        ticks = np.append(0.0, np.cumsum(h))
        path = CommandPath(ticks, u, robot.effects, robot.joints)
        weight = robot.kinematic_tree.mass_matrix(rng.normal(size=(M, robot.layout.n_link)))
        steps = Steps(h, u, robot.noise, robot.layout, weight, path if path.changes else None, np.arange(M))
        last = robot.effects[-1].effect if robot.effects else None
        if not isinstance(last, ReadingEffect | SmoothedReading | TimeShift):
            yield f"dynamics with {label}", SimpsonDynamics(ElasticJoints(robot), steps, robot.joints), robot
            if path.changes or not label:
                running = replace(steps, path=CommandPath(ticks, u, robot.effects, robot.joints, runs_on=True))
                yield f"measured signal {label}", SimpsonDynamics(ElasticJoints(robot), running, robot.joints), robot
            gentle = replace(steps, sliding=rng.choice([0.1, 1.0], (M, 2, robot.n)))
            yield f"gentle friction, {label}", SimpsonDynamics(ElasticJoints(robot), gentle, robot.joints), robot
        for name, sensor in robot.sensors.items():
            values = {n: p.value for n, p in robot.parameters.items()}
            times, fraction = rng.uniform(1.0, 2.0, M), rng.uniform(size=M)
            factor = factor_on_state(robot, name, rng.normal(size=(M, len(sensor.channels))), times)
            yield f"{name} with {label}", factor, robot
            channels, late = late_channels(robot, name)[-1]
            if late:
                lateness = Lateness.of(robot, late, times)
                some = SomeChannels(factor, channels)
                moved = InterpolatedFactor(some, fraction, h, robot.layout, lateness, values)
                yield f"late {name} with {label}", moved, robot


def _accelerometers():
    """Doggy with an accelerometer on its last IMU, as it is and with what acts on it: late stamps, a soft bearing."""
    source = replace(ROBOT.sensors["imu2"].source, field="linear_acceleration", unit="m/s^2")
    down = np.array([0.0, 0.0, -9.81])
    accelerometer = Accelerometer("acc", source, "imu2", 0.02, np.zeros(3), 0.5, gravity=down)
    places = [Parameter(name, 0.1, "m", 0.1, 0.1, positive=False) for name in accelerometer.lever]
    parameters = {**ROBOT.parameters, **{p.name: p for p in places}}
    plain = replace(ROBOT, sensors={**ROBOT.sensors, "acc": accelerometer}, parameters=parameters)
    for label in ("", "clock_offset@robot", "clock_offset@imu2", "bearing_flexibility@joint1"):
        effect = {} if not label else dict(catalogue()[label.split("@")[0]].example)
        robot = add_effect(plain, label, effect) if label else plain
        (sensor,) = robot.accelerometers
        rng = np.random.default_rng(7)
        times, fraction, h = rng.uniform(1.0, 2.0, M), rng.uniform(size=M), rng.uniform(0.1, 0.2, size=M)
        ((_, late),) = late_channels(robot, sensor.name)
        lateness = Lateness.of(robot, late, times) if late else None
        inner = factor_on_state(robot, sensor.name, rng.normal(size=(M, 3)), times)
        values = {n: p.value for n, p in robot.parameters.items()}
        yield f"accelerometer {label}", AcceleratedFactor(inner, fraction, h, robot.layout, lateness, values), robot


FACTORS = {name: (factor, ROBOT) for name, factor in _factors()}
FACTORS |= {name: (factor, robot) for name, factor, robot in _factors_with_effects()}
FACTORS |= {name: (factor, robot) for name, factor, robot in _accelerometers()}


def _point(factor, robot):
    """Random states, slow enough that the friction's slope matters, and a calibration away from the start."""
    rng = np.random.default_rng(2)
    layout = robot.layout
    x0 = rng.normal(size=(len(factor), layout.size)) * 0.5
    x0[:, layout.v_link] *= 0.8
    x0[:, layout.q_motor] = x0[:, layout.joint_q[: layout.n_motor]] + 0.02 * rng.normal(
        size=(len(factor), layout.n_motor)
    )
    x0[:, layout.v_motor] *= 0.008
    x1 = x0 + rng.normal(size=x0.shape) * 1e-3
    calibration = Calibration.of(robot)
    calibration = calibration.retract({b: rng.normal(size=calibration.block_size(b)) * 0.1 for b in calibration.blocks})
    values = calibration.values
    for i, name in enumerate(calibration.names):
        effect = robot.parameters[name].effect
        if effect is not None:  # a tenth beside its size, whatever its unit
            values[i] = robot.parameters[name].value * 1.1
    dynamics = np.where(calibration.positive, np.log(np.where(calibration.positive, values, 1.0)), values)
    return (x0, x1)[: factor.states], calibration.with_points({DYNAMICS: dynamics})


def _difference(function, size, steps=None):
    """Central differences of a function of a small vector; the last axis is the vector."""
    columns = []
    for i, step in enumerate(np.full(size, 1e-6) if steps is None else steps):
        d = np.zeros(size)
        d[i] = step
        columns.append((function(d) - function(-d)) / (2 * step))
    return np.stack(columns, axis=-1)


def _size(expected):
    """Largest derivative of each row; a row that nearly stands still is held against a hundredth of the others."""
    return np.abs(expected).max(axis=2, keepdims=True) + 0.01 * np.abs(expected).max(axis=(0, 2), keepdims=True)


def _steps(block, calibration, robot):
    """Small parameters of effects, in seconds or radians, ask for small steps."""
    steps = np.full(calibration.block_size(block), 1e-6)
    if block == "dynamics":
        for i, name in enumerate(calibration.names):
            if robot.parameters[name].effect is not None and not calibration.positive[i]:
                steps[i] = min(1e-6, 1e-5 * abs(calibration.values[i]))
    return steps


@pytest.mark.parametrize("name", FACTORS)
def test_jacobians_equal_finite_differences(name):
    factor, robot = FACTORS[name]
    x, calibration = _point(factor, robot)
    linear = factor.linearize(x, calibration)
    np.testing.assert_allclose(linear.residual, factor.residual(x, calibration), rtol=1e-12, atol=1e-13)
    scale = np.broadcast_to(factor.sigmas, linear.residual.shape)[:, :, None]
    assert linear.residual.shape == (len(factor), len(factor.rows))
    assert len(linear.by_state) == factor.states
    assert set(linear.by_block) == set(factor.blocks)
    for i, J in enumerate(linear.by_state):

        def moved(d, i=i):
            return factor.residual(tuple(s + d if j == i else s for j, s in enumerate(x)), calibration)

        # rows differ in size by their units: compare row by row
        expected = _difference(moved, x[i].shape[1])
        size = _size(expected) + scale * 1e-3 + ROUNDING
        assert np.max(np.abs(J - expected) / size) < 5e-6, f"derivative by state {i}"
    for block in factor.blocks:
        expected = _difference(
            lambda d, b=block: factor.residual(x, calibration.retract({b: d})),
            calibration.block_size(block),
            _steps(block, calibration, robot),
        )
        size = _size(expected) + scale * 1e-3 + ROUNDING
        assert np.max(np.abs(linear.by_block[block] - expected) / size) < 5e-6, f"derivative by {block}"


@pytest.mark.parametrize("name", FACTORS)
def test_gtsam_linearizes_the_wrapped_factor_to_the_whitened_jacobians(name):
    factor, robot = FACTORS[name]
    x, calibration = _point(factor, robot)
    sample = len(factor) - 1
    wrapped = single_factor(factor, sample, tuple(range(factor.states)), calibration)
    values = gtsam.Values()
    insert_calibration(values, calibration)
    for k, states in enumerate(x):
        values.insert(state_key(k), states[sample])
    linear = factor.linearize(x, calibration)
    sigmas = np.broadcast_to(factor.sigmas, linear.residual.shape)[sample]
    A, b = wrapped.linearize(values).jacobian()
    stacked = [J[sample] for J in linear.by_state] + [linear.by_block[block][sample] for block in factor.blocks]
    np.testing.assert_allclose(A, np.hstack(stacked) / sigmas[:, None], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(b, -linear.residual[sample] / sigmas, rtol=1e-9)
    assert wrapped.error(values) == pytest.approx(0.5 * np.sum((linear.residual[sample] / sigmas) ** 2))


def test_gtsam_moves_a_rotation_from_the_right_as_the_calibration_does():
    calibration = Calibration.of(ROBOT)
    values = gtsam.Values()
    insert_calibration(values, calibration)
    step = np.array([0.1, -0.2, 0.3])
    delta = gtsam.VectorValues()
    delta.insert(gtsam.symbol("r", 1), step)
    moved = values.retract(delta).atRot3(gtsam.symbol("r", 1)).matrix()
    np.testing.assert_allclose(moved, calibration.retract({"imu2.rotation": step}).rotations["imu2"], atol=1e-12)


def test_a_chain_linearizes_as_its_pairs_do():
    """The chain shares rigid-body derivatives between steps; residuals are the same, Jacobians to parts per million."""
    rng = np.random.default_rng(3)
    t = np.arange(41)[:, None] * 1e-3
    phase = rng.uniform(0, 6, 3)
    q = 0.6 * np.sin(8.0 * t + phase)
    v = 4.8 * np.cos(8.0 * t + phase)
    x = np.hstack([q, v, q + 0.01 * np.sin(30.0 * t), v + 0.3 * np.cos(30.0 * t)])
    plain = Steps(np.full(40, 1e-3), rng.uniform(-1, 1, (40, 3)), ROBOT.noise, ROBOT.layout)
    at_ticks = rng.choice([0.1, 1.0], (41, 3))
    gentle = replace(plain, sliding=np.stack([at_ticks[:-1], at_ticks[1:]], axis=1))
    calibration = Calibration.of(ROBOT)
    for kind, steps in product((EulerDynamics, MidpointDynamics, SimpsonDynamics), (plain, gentle)):
        factor = kind(ElasticJoints(ROBOT), steps, ROBOT.joints)
        pairs, chain = factor.linearize((x[:-1], x[1:]), calibration), factor.linearize_chain(x, calibration)
        np.testing.assert_allclose(chain.residual, pairs.residual, rtol=1e-12, atol=1e-14)
        for a, b in zip(
            (*chain.by_state, chain.by_block["dynamics"]), (*pairs.by_state, pairs.by_block["dynamics"]), strict=True
        ):
            size = np.abs(b).max(axis=(0, 2), keepdims=True)
            assert np.max(np.abs(a - b) / np.where(size == 0.0, 1.0, size)) < 1e-5  # a rule may have nothing there
