# SPDX-License-Identifier: BSD-3-Clause
"""The batched solver against GTSAM's own optimizer and against dense algebra."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.factors.calibration import Calibration
from jointscope.graphs.comparison.causal_filter import filter_around, filter_states
from jointscope.graphs.gtsam_solvers.reference_graph import initial_values, nonlinear_graph
from jointscope.graphs.gtsam_solvers.samples_solver import solve_samples
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.banded_solver import eliminate
from jointscope.graphs.solving.batch_solver import solve, total_cost
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.normal_equations import build, linearize_all
from jointscope.graphs.solving.posterior import StatePosterior, posteriors, residual_parts
from jointscope.graphs.starts.initial_guess import initial_biases, initial_states
from jointscope.robots.errors import SolveError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream


def _short(recording, t0, seconds, every=1):
    """A slice; `every` thins the gyros so that streams have different rates."""
    part = recording.between(t0, t0 + seconds)
    streams = dict(part.streams)
    for name in ("imu1", "imu2"):
        s = streams[name]
        streams[name] = Stream(name, s.times[::every], s.values[::every], s.channels, s.unit)
    return Recording(part.path, part.sha256, part.start_ns, streams)


def _start(robot, recordings):
    problems = [BagProblem.of(robot, r) for r in recordings]
    calibrations = [initial_biases(p, Calibration.of(robot)) for p in problems]
    states = [initial_states(p, c) for p, c in zip(problems, calibrations, strict=True)]
    return problems, Estimate(tuple(states), tuple(calibrations))


def _noisier(robot, factor):
    noise = robot.noise
    return replace(
        robot,
        noise=replace(noise, link_velocity=noise.link_velocity * factor, motor_velocity=noise.motor_velocity * factor),
    )


@pytest.fixture(scope="module")
def moving(simulated, doggy):
    """A quarter of a second in motion with thinned, shifted gyros, as problem and start."""
    recording = _short(simulated.recording, 5.0, 0.25, every=3)
    shifted = dict(recording.streams)
    imu = shifted["imu2"]
    shifted["imu2"] = Stream("imu2", imu.times + 3.7e-4, imu.values, imu.channels, imu.unit)
    truth = {k: v for k, v in simulated.truth["parameters"].items() if k in doggy.parameters}
    robot = _noisier(doggy.with_values({k: 1.2 * v for k, v in truth.items()}), 0.1)
    return _start(robot, [Recording("slice", "", 0, shifted)])


@pytest.mark.parametrize("name", ["doggy", "doggy_paper"])
def test_batched_cost_equals_the_cost_of_the_gtsam_graph(name, simulated):
    robot = load_robot(name)
    problems, start = _start(robot, [_short(simulated.recording, 5.0, 0.05, every=4)])
    graph = nonlinear_graph(problems, start)
    assert graph.error(initial_values(start)) == pytest.approx(total_cost(problems, start), rel=1e-9)


@pytest.mark.slow
def test_batched_solver_ends_where_gtsam_ends(moving):
    problems, start = moving
    fast = solve(problems, start, max_iterations=200, step_tolerance=1e-6)
    slow = solve_samples(problems, start)
    assert fast.cost == pytest.approx(slow.cost, rel=1e-6)
    _, covariance = posteriors(problems, fast)
    sigma = np.sqrt(np.diag(covariance))
    a, b = fast.estimate.calibrations[0], slow.estimate.calibrations[0]
    assert np.max(np.abs(a.dynamics - b.dynamics) / sigma[:12]) < 1e-3
    for gyro in a.biases:
        np.testing.assert_allclose(a.biases[gyro], b.biases[gyro], atol=1e-3 * sigma[-1])
        np.testing.assert_allclose(a.rotations[gyro], b.rotations[gyro], atol=1e-5)
    np.testing.assert_allclose(fast.estimate.states[0], slow.estimate.states[0], atol=2e-5)


@pytest.mark.slow
def test_two_recordings_share_parameters_as_in_the_gtsam_graph(simulated, doggy):
    robot = _noisier(doggy, 0.3)
    parts = [_short(simulated.recording, t, 0.04, every=2) for t in (4.0, 6.0)]
    problems, start = _start(robot, parts)
    graph = nonlinear_graph(problems, start)
    assert graph.error(initial_values(start)) == pytest.approx(total_cost(problems, start), rel=1e-9)
    fast = solve(problems, start, max_iterations=60, step_tolerance=1e-6)
    slow = solve_samples(problems, start, max_iterations=100)
    assert fast.cost == pytest.approx(slow.cost, rel=1e-5)
    a, b = fast.estimate.calibrations, slow.estimate.calibrations
    np.testing.assert_array_equal(a[0].dynamics, a[1].dynamics)
    assert not np.allclose(a[0].biases["imu1"], a[1].biases["imu1"])
    _, covariance = posteriors(problems, fast)
    sigma = np.sqrt(np.diag(covariance))[fast.shared.places[1]["imu1.bias"]]
    assert np.max(np.abs(a[1].biases["imu1"] - b[1].biases["imu1"]) / sigma) < 1e-3


def _dense(system):
    m, d, p = system.B.shape
    A = np.zeros((m * d + p, m * d + p))
    for k in range(m):
        A[k * d : (k + 1) * d, k * d : (k + 1) * d] = system.D[k]
        if k + 1 < m:
            A[(k + 1) * d : (k + 2) * d, k * d : (k + 1) * d] = system.E[k]
            A[k * d : (k + 1) * d, (k + 1) * d : (k + 2) * d] = system.E[k].T
    A[: m * d, m * d :] = system.B.reshape(m * d, p)
    A[m * d :, : m * d] = system.B.reshape(m * d, p).T
    A[m * d :, m * d :] = system.C
    return A


def _random_chain(m=7, d=4, p=3, seed=0):
    """Normal equations of random residuals on neighbouring states and shared values."""
    from jointscope.graphs.solving.normal_equations import NormalEquations

    rng = np.random.default_rng(seed)
    system = NormalEquations.zeros(m, d, p)
    for k in range(m - 1):
        J = rng.normal(size=(2 * d + p, 2 * d + p))
        H = J.T @ J
        system.D[k] += H[:d, :d]
        system.D[k + 1] += H[d : 2 * d, d : 2 * d]
        system.E[k] += H[d : 2 * d, :d]
        system.B[k] += H[:d, 2 * d :]
        system.B[k + 1] += H[d : 2 * d, 2 * d :]
        system.C += H[2 * d :, 2 * d :]
    system.g_x[:] = rng.normal(size=(m, d))
    system.g_p[:] = rng.normal(size=p)
    return system


def test_elimination_equals_dense_algebra():
    system = _random_chain()
    m, d, _p = system.B.shape
    full = -np.linalg.solve(_dense(system), np.concatenate([system.g_x.ravel(), system.g_p]))
    elimination = eliminate(system)
    dp = -np.linalg.solve(elimination.S, elimination.s)
    np.testing.assert_allclose(dp, full[m * d :], rtol=1e-8)
    np.testing.assert_allclose(elimination.states(dp).ravel(), full[: m * d], rtol=1e-7)


def test_backward_recursion_gives_the_blocks_of_the_dense_inverse():
    system = _random_chain()
    m, d, _p = system.B.shape
    inverse = np.linalg.inv(_dense(system))
    elimination = eliminate(system)
    posterior = StatePosterior.of(elimination, np.linalg.inv(elimination.S))
    for k in range(m):
        np.testing.assert_allclose(
            posterior.covariance(k), inverse[k * d : (k + 1) * d, k * d : (k + 1) * d], rtol=1e-6, atol=1e-9
        )
    np.testing.assert_allclose(posterior.sigmas.ravel(), np.sqrt(np.diag(inverse)[: m * d]), rtol=1e-6)
    known = np.linalg.inv(_dense(system)[: m * d, : m * d])
    np.testing.assert_allclose(posterior.neighbours[2], known[2 * d : 3 * d, 3 * d : 4 * d], rtol=1e-6, atol=1e-9)


def test_a_state_that_nothing_determines_is_named():
    system = _random_chain()
    system.D[3] = 0.0
    with pytest.raises(SolveError, match=r"the state at tick 3 \(component 0 of 4\) is not determined"):
        eliminate(system)


def test_leverages_sum_to_the_number_of_unknowns(moving):
    problems, start = moving
    solution = solve(problems, start, max_iterations=60)
    found, covariance = posteriors(problems, solution)
    bag = (problems[0], solution.estimate.states[0], solution.estimate.calibrations[0])
    parts = residual_parts(linearize_all(*bag), bag[2], found[0])
    total = sum(float(part.leverage.sum()) for part in parts)
    shared = covariance.shape[0]
    # priors on dynamics and rotations are not among the recording's factors and take the rest
    assert solution.estimate.states[0].size < total < solution.estimate.states[0].size + shared


def test_filter_at_the_last_tick_equals_the_smoother(moving):
    problems, start = moving
    held = ("dynamics", "imu1.rotation", "imu2.rotation", "imu1.bias", "imu2.bias")
    estimate = start
    for _ in range(15):  # with every shared value held it ends where the cost hardly falls; the states go on a little
        estimate = solve(problems, estimate, max_iterations=60, step_tolerance=1e-6, hold=held).estimate
    x, calibration = estimate.states[0], estimate.calibrations[0]
    filtered = filter_around(problems[0], x, calibration)
    sigma = np.sqrt(np.einsum("kii->ki", filtered.covariance))
    assert np.max(np.abs(filtered.mean[-1] - x[-1]) / sigma[-1]) < 0.05
    own = filter_states(problems[0], calibration, x)
    # linearised around its own past the filter ends near the smoother: one motor turns slowly, where friction bends
    # within a sigma and a quantized encoder tells little
    assert np.max(np.abs(own.mean[-1] - x[-1]) / sigma[-1]) < 2.0
    posterior = StatePosterior.of(eliminate(build(problems[0], x, calibration)), np.zeros((24, 24)))
    np.testing.assert_allclose(sigma[-1], posterior.sigmas[-1], rtol=0.02)


def test_filter_does_not_look_ahead(moving):
    """Changing the future must not change the past."""
    problems, start = moving
    x, calibration = start.states[0], start.calibrations[0]
    held = ("dynamics", "imu1.rotation", "imu2.rotation", "imu1.bias", "imu2.bias")
    recording = problems[0].recording
    cut = float(recording.command.times[120])
    streams = dict(recording.streams)
    encoder = streams["motor_encoder"]
    changed = encoder.values + np.where(
        encoder.times[:, None] > cut, 20.0 * problems[0].robot.motor_encoder.sigmas, 0.0
    )
    streams["motor_encoder"] = Stream("motor_encoder", encoder.times, changed, encoder.channels, encoder.unit)
    other = BagProblem.of(problems[0].robot, Recording("changed", "", 0, streams))
    results = []
    for problem in (problems[0], other):
        smoothed = solve([problem], Estimate((x,), (calibration,)), max_iterations=60, hold=held).estimate
        results.append(filter_states(problem, calibration, smoothed.states[0]))
    a, b = results
    sigma = np.sqrt(np.einsum("kii->ki", a.covariance))
    difference = np.abs(a.mean - b.mean) / sigma
    # what remains is where each piece of the filter began, half a second earlier; slow samples forget it slowly
    assert np.max(difference[:119]) < 1e-3
    assert np.max(difference[123:140]) > 1.0
