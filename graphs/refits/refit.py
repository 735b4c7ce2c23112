# SPDX-License-Identifier: BSD-3-Clause
"""A real calibration with one more effect, on the fitting pieces of the training recordings.

It starts from the base model's states and values and from the sizes that the score test predicts, so a few iterations
do. The process noise is estimated again: the base model's noise has swallowed part of the effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.calibration.base_model import BaseModel, Span
from jointscope.graphs.noise.noise_estimation import estimate_noise, not_below
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.problem.known_values import carried, with_known_values
from jointscope.graphs.scoring.columns.gap import BEYOND, curves_of, tried_gap
from jointscope.graphs.scoring.hypothesis_score import HypothesisScore
from jointscope.graphs.solving.batch_solver import Solution, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.posterior import posteriors
from jointscope.robots.dynamics.transmission import Transmission
from jointscope.robots.effect_kinds.effect_at import EffectAt
from jointscope.robots.effect_kinds.joint_torque import JointSignals, JointTorque, beyond_gap
from jointscope.robots.effect_kinds.structure import Structure
from jointscope.robots.effect_kinds.time_shift import TimeShift
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.model.encoder_plays import unlagged
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.parts.sensors import Sensor
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

FOLLOWING, FIRST_ITERATIONS, LAST_ITERATIONS, NOISE_CYCLES = 6, 8, 8, 6
EASY = 0.05  # [rad/s/sqrt(s), m/s/sqrt(s)] smallest densities with which a refit begins
ENOUGH = 0.3  # [sigma] last step of a refit
SMALLEST_START = 0.05  # of the start value: where a logarithmic size begins if the score test wants less
STEP = 1e-30  # of complex steps
SOFTEST = 0.05  # of the prior stiffness, the least with which a spring begins


@dataclass(frozen=True)
class Refit:
    """A model with one more effect, fitted.

    Attributes:
        robot: with the values and noise found.
        label: ID@OWNER of the effect; empty for the base model itself.
        biases: shared values that hold the biases of each recording.
        sigmas: standard deviation of each of the effect's parameters in its unit, by the last part of its name.
        converged: whether the last step was small.
    """

    robot: Robot
    label: str
    biases: tuple[Calibration, ...]
    sigmas: dict[str, float]
    converged: bool


@dataclass(frozen=True)
class BegunRefit:
    """A refit whose values have been fitted at the noise of the base model; half of the work is still to come.

    Attributes:
        base: the base model.
        spans: pieces that are fitted.
        robot: with the effect, where it began.
        label: ID@OWNER of the effect; empty for the base model itself.
        noise: with which they were fitted.
        problems: the pieces.
        solution: of these.
    """

    base: BaseModel
    spans: tuple[Span, ...]
    robot: Robot
    label: str
    noise: ProcessNoise
    problems: tuple[BagProblem, ...]
    solution: Solution

    @staticmethod
    def of(base: BaseModel, spans: Sequence[Span], score: HypothesisScore | None, label: str = "") -> BegunRefit:
        """Arguments and errors as of `refit`."""
        robot = base.robot
        if score is not None:
            robot = with_hidden_gap(add_effect(robot, score.hypothesis.label, start_of(score, robot)), base, score)
        elif label and not robot.has_effect(*label.split("@")):
            robot = add_effect(robot, label)
        # noise that is next to nothing holds the states where the model without the effect has them
        noise = not_below(robot.noise, EASY) if robot.noise.estimate else robot.noise
        problems, estimate = pieces_of(base, replace(robot, noise=noise), spans)
        if robot is not base.robot:
            # the states still are those of a model without the effect: they follow before all parameters move
            estimate = _followed(problems, estimate)
        solution = solve(problems, estimate, max_iterations=FIRST_ITERATIONS, step_tolerance=ENOUGH)
        name = score.hypothesis.label if score is not None else label
        return BegunRefit(base, tuple(spans), robot, name, noise, tuple(problems), solution)

    def further(self) -> BegunRefit:
        """As many iterations again."""
        start = self.solution.estimate
        found = solve(self.problems, start, max_iterations=FIRST_ITERATIONS, step_tolerance=ENOUGH)
        return replace(self, solution=found)

    def finished(self) -> Refit:
        """With the noise that the effect leaves; errors as of `refit`."""
        problems, estimate = _with_short_impacts(self.problems, self.solution.estimate)
        robot, noise = self.robot, self.noise
        if noise.estimate:
            noise, estimate = estimate_noise(problems, estimate, cycles=NOISE_CYCLES)
        if any(isinstance(here.effect, TimeShift) for here in robot.effects):
            moved = _with(robot, estimate.calibrations[0])
            problems = [p.of_robot(moved) for p in problems]
        problems = [problem.with_noise(noise) for problem in problems]
        solution = solve(problems, estimate, max_iterations=LAST_ITERATIONS, step_tolerance=ENOUGH)
        found = solution.estimate.calibrations[0]
        _, covariance = posteriors(problems, solution)
        sigma = np.sqrt(np.diag(covariance))[: len(found.names)] * found.value_by_coordinate
        own = {
            full.rsplit(".", 1)[1]: float(value)
            for full, value in zip(found.names, sigma, strict=True)
            if self.label and full.startswith("{1}.{0}.".format(*self.label.split("@")))
        }
        robot = replace(_with(robot, found), noise=noise)
        biases = _biases(self.base, self.spans, solution.estimate.calibrations)
        return Refit(robot, self.label, biases, own, solution.converged)


def refit(base: BaseModel, spans: Sequence[Span], score: HypothesisScore | None, label: str = "") -> Refit:
    """Fits the base model plus one effect.

    Args:
        base: the base model.
        spans: pieces to fit.
        score: the effect, its shapes and where to start; None fits the robot of `base` itself.
        label: another effect than that of the score, started at its own start values unless the base model has it.

    Raises:
        SolveError: the fit ran away.
    """
    return BegunRefit.of(base, spans, score, label).finished()


def _followed(problems: Sequence[BagProblem], start: Estimate) -> Estimate:
    """States that follow parameters as they are."""
    pairs = [with_known_values(*pair) for pair in zip(problems, start.calibrations, strict=True)]
    known = Estimate(start.states, tuple(calibration for _, calibration in pairs))
    found = solve([problem for problem, _ in pairs], known, max_iterations=FOLLOWING, hold=(DYNAMICS,)).estimate
    back = [carried(*pair) for pair in zip(found.calibrations, start.calibrations, strict=True)]
    return Estimate(found.states, tuple(back))


def _with_short_impacts(problems: Sequence[BagProblem], estimate: Estimate) -> tuple[list[BagProblem], Estimate]:
    """With short steps where springs meet edges of dead zones, as a calibration has them."""
    values = estimate.calibrations[0].by_name
    pairs = [p.divided(x, values) for p, x in zip(problems, estimate.states, strict=True)]
    return [p for p, _ in pairs], Estimate(tuple(x for _, x in pairs), estimate.calibrations)


def start_of(score: HypothesisScore, robot: Robot) -> dict[str, float]:
    """Where the refit starts: the predicted sizes, kept positive where the law needs it, and the best shapes."""
    here, start = score.hypothesis.here, {}
    for size, value in zip(score.hypothesis.sizes, score.estimate, strict=True):
        start[size.name] = float(value)
    start |= score.hypothesis.shapes
    known = [p for p in here.effect.parameters_at(robot, here.owner) if p.name in start]
    least = {p.name: SMALLEST_START * p.start if p.logarithmic else -np.inf for p in known}
    start = {name: max(start[name], smallest) for name, smallest in least.items()}
    if isinstance(here.effect, Structure) and here.effect.form == "bearing":
        start |= _bearing_start(score, robot)
    return start


def _bearing_start(score: HypothesisScore, robot: Robot) -> dict[str, float]:
    """Inertia and damping that give the best resonance with the predicted compliance."""
    here, start = score.hypothesis.here, {}
    omega, ratio = 2.0 * np.pi * score.hypothesis.shapes["frequency"], score.hypothesis.shapes["damping_ratio"]
    usual = {p.name: p.start for p in here.effect.parameters_at(robot, here.owner)}
    for axis, size, value in zip("xy", score.hypothesis.sizes, score.estimate, strict=True):
        compliance = max(float(value), SMALLEST_START * size.start)
        inertia = float(
            np.clip(1.0 / (compliance * omega**2), 0.5 * usual[f"inertia_{axis}"], 2.0 * usual[f"inertia_{axis}"])
        )
        start[f"inertia_{axis}"] = inertia
        start[f"damping_{axis}"] = 2.0 * ratio * float(np.sqrt(inertia / compliance))
    return start


def pieces_of(base: BaseModel, robot: Robot, spans: Sequence[Span]) -> tuple[list[BagProblem], Estimate]:
    """The pieces as problems of the new robot, with the base model's states."""
    problems, states, calibrations = [], [], []
    for span in spans:
        piece: Recording = base.recordings[span.bag].between(span.t0, span.t1)
        problem = replace(BagProblem.of(robot, piece, base.between(span.bag)), owner=span.bag)
        problems.append(problem)
        x = base.states_at(span.bag, problem.timeline.ticks, robot.layout)
        states.append(unlagged(robot, x, known=base.layout.memories))
        calibrations.append(Calibration.of(robot).with_points(base.calibrations[span.bag].own))
    return problems, Estimate(tuple(states), tuple(calibrations))


def _with(robot: Robot, calibration: Calibration) -> Robot:
    """The robot with the values of a calibration."""
    values = calibration.by_name
    sensors: dict[str, Sensor] = {
        sensor.name: replace(sensor, bias=calibration.biases[sensor.name]) for sensor in robot.accelerometers
    }
    sensors |= {
        gyro.name: replace(gyro, R_imu_body=calibration.rotations[gyro.name], bias=calibration.biases[gyro.name])
        for gyro in robot.gyros
    }
    return robot.with_values(values).with_sensors(sensors)


def _biases(base: BaseModel, spans: Sequence[Span], found: Sequence[Calibration]) -> tuple[Calibration, ...]:
    """Biases of each recording: the mean over its pieces."""
    result = []
    for bag, calibration in enumerate(base.calibrations):
        own = [c for span, c in zip(spans, found, strict=True) if span.bag == bag]
        mean = {name: np.mean([c[name] for c in own], axis=0) for name in calibration.own} if own else {}
        result.append(calibration.with_points(mean))
    return tuple(result)


def with_hidden_gap(robot: Robot, base: BaseModel, score: HypothesisScore | None) -> Robot:
    """The robot with a spring and a damper that begin beyond the gap of a hypothesis; as it is for all others.

    Args:
        robot: with the effect that the hypothesis adds.
        base: the model without it, whose states tell which torques the spring had.
        score: the hypothesis.
    """
    effect = None if score is None else score.hypothesis.here.effect
    if score is None or not isinstance(effect, JointTorque) or not (gap := tried_gap(effect, score.hypothesis)):
        return robot
    here, sizes = score.hypothesis.here, [size.name for size in score.hypothesis.sizes]
    stiffness, damping = (f"{here.owner}.{name}" for name in BEYOND)
    values = _curve_beyond(base, here, gap)
    found = dict(zip(sizes, score.estimate.tolist(), strict=True))
    values[stiffness] = max(values[stiffness], SOFTEST * robot.parameters[stiffness].prior)
    values[damping] = max(found[BEYOND[1]], SOFTEST * robot.parameters[damping].prior)
    return robot.with_values({name: value for name, value in values.items() if not robot.parameters[name].fixed})


def _curve_beyond(base: BaseModel, here: EffectAt, gap: tuple[float, ...]) -> dict[str, float]:
    """Stiffness and terms of the curve that give the base model's torques from the deflection beyond a gap."""
    robot = base.robot
    values = robot.values
    d = np.concatenate([_deflection(robot, values, x, here.owner) for x in base.states])
    stiffness, curves = f"{here.owner}.{BEYOND[0]}", curves_of(robot, here)
    names, before = [stiffness], values[stiffness] * d
    columns, sigmas = [beyond_gap(d, *gap)], [robot.parameters[stiffness].prior_sigma]
    for curve in curves:
        assert isinstance(curve.effect, JointTorque)
        law, own = curve.effect.law, curve.own(values)
        if curve.effect.curve != "terms":  # knots and lengths stay; what such a law has by the stiffness follows it
            beside, beyond = (np.real(law(_signals(d, k, gap), own)) for k in (0.0, 1.0))
            before = before + np.real(law(_signals(d, values[stiffness]), own)) - beside
            columns[0] = columns[0] + beyond - beside
            continue
        before = before + np.real(law(_signals(d), own))
        nothing = dict.fromkeys(own, 0.0)
        for name in own:
            slope = law(_signals(d, gap=gap), {**nothing, name: 1j * STEP})
            names.append(curve.parameter(name))
            columns.append(np.imag(slope) / STEP)
            sigmas.append(robot.parameters[names[-1]].prior_sigma)
    A = np.column_stack(columns)
    # priors keep terms that the few large deflections do not tell from running away
    weight = np.diag([1.0 / (sigma or np.inf) for sigma in sigmas]) * float(np.std(before))
    solution = np.linalg.lstsq(np.vstack([A, weight]), np.concatenate([before, np.zeros(len(names))]), rcond=None)[0]
    return dict(zip(names, map(float, solution), strict=True))


def _deflection(robot: Robot, values: dict[str, float], x: Array, joint: str) -> Array:
    """What the spring sees, shape (m,)."""
    layout, j, transmission = robot.layout, robot.joints.index(joint), Transmission.of(robot)
    seen = x if transmission is None else x @ transmission.maps(values)[0].T
    return np.asarray(seen[:, layout.joint_q[j]] - seen[:, layout.motor_q[j]])


def _signals(d: Array, stiffness: float = 0.0, gap: tuple[float, ...] | None = None) -> JointSignals:
    """A spring that is bent and at rest."""
    still = np.zeros_like(d)
    return JointSignals(d, still, still, still, still, stiffness, gap=gap)
