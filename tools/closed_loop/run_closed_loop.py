# SPDX-License-Identifier: BSD-3-Clause
"""Several closed loops on one robot, one plan, one set of random numbers: only controller and state source differ."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from jointscope.robots.dynamics.transmission import joint_angles
from jointscope.robots.errors import RobotError, SimulationError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.sensors import Sensor
from jointscope.tools.closed_loop.closed_loop_result import CONTROLLERS, SOURCES, ClosedLoopResult, LoopRun
from jointscope.tools.closed_loop.controllers.control_law import ControlLaw
from jointscope.tools.closed_loop.controllers.flexible_joint_control import RECIPES, ROBOTS, FlexibleJointControl
from jointscope.tools.closed_loop.controllers.proportional_control import ProportionalControl
from jointscope.tools.closed_loop.controllers.state_feedback import StateFeedback
from jointscope.tools.closed_loop.loop import Loop
from jointscope.tools.closed_loop.planning.hitting_plan import hitting_plan
from jointscope.tools.closed_loop.planning.loop_stability import growth
from jointscope.tools.closed_loop.planning.moves_plan import moves_plan
from jointscope.tools.closed_loop.planning.plan import Plan
from jointscope.tools.closed_loop.planning.reference import model_reference
from jointscope.tools.closed_loop.planning.tracking import tracking
from jointscope.tools.closed_loop.sources.differentiated_encoders import CUTOFF, DifferentiatedEncoders
from jointscope.tools.closed_loop.sources.estimated_state import (
    LAG,
    EstimatedState,
    MakeEstimator,
    fixed_lag_estimator,
)
from jointscope.tools.closed_loop.sources.state_source import StateSource
from jointscope.tools.closed_loop.sources.true_state import TrueState
from jointscope.tools.simulator.loop.controller import full_command
from jointscope.tools.simulator.loop.online_sensors import OnlineSensors
from jointscope.tools.simulator.occasion import Conditions, Occasion
from jointscope.tools.simulator.truth import true_robot
from jointscope.tools.simulator.world.engine import TICK, Engine
from jointscope.tools.simulator.world.random_streams import random_stream

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

SECONDS = 10.0  # [s]
USUAL = ("p", "state_feedback")  # controllers of a robot that has no others
PLANS = {"hits": hitting_plan, "moves": moves_plan}
MISMATCH = 0.02  # relative standard deviation of a well calibrated model's parameters


@dataclass(frozen=True)
class LoopOptions:
    """What is compared, and how the sources are set.

    Attributes:
        controllers: of `CONTROLLERS`; none: those that are made for the robot.
        sources: of "true", "encoders" and "estimator".
        lag: of the estimator [s].
        cutoff: of the low-pass behind the differences [Hz].
        mismatch: relative standard deviation of the parameters where no model is given.
        make_estimator: makes an estimator of a model and a lag.
        motion: "hits" of balls, or "moves", far ones of all joints; none: what is usual for the robot.
    """

    controllers: Sequence[str] | None = None
    sources: Sequence[str] = tuple(SOURCES)
    lag: float = LAG
    cutoff: float = CUTOFF
    mismatch: float = MISMATCH
    make_estimator: MakeEstimator = fixed_lag_estimator
    motion: str | None = None

    def __post_init__(self) -> None:
        for what, given, known in (
            ("controller", tuple(CONTROLLERS) if self.controllers is None else self.controllers, CONTROLLERS),
            ("motion", PLANS if self.motion is None else (self.motion,), PLANS),
            ("source", self.sources, SOURCES),
        ):
            unknown = [name for name in given if name not in known]
            if unknown:
                raise SimulationError(f"unknown {what} {unknown[0]!r}; expected {', '.join(known)}")
            if not given:
                raise SimulationError(f"no {what} is named; expected some of {', '.join(known)}")
        for name, low, high in (("lag", 1e-3, 10.0), ("cutoff", 0.1, 500.0), ("mismatch", 0.0, 0.5)):
            if not low <= getattr(self, name) <= high:
                raise SimulationError(f"{name}: expected {low:g} to {high:g}, got {getattr(self, name):g}")


def run_closed_loop(
    robot: Robot,
    model: Robot | None = None,
    seconds: float = SECONDS,
    seed: int = 0,
    conditions: Conditions | None = None,
    options: LoopOptions | None = None,
    progress: Progress | None = None,
    say: Callable[[str], None] = lambda line: None,
) -> ClosedLoopResult:
    """Lets every controller hit balls, or make far moves, with every state source.

    Args:
        robot: the robot; its published values are the truth.
        model: what controllers and estimator know; by default the truth without hidden effects, gyros mounted as they
            really are, its parameters off by `options.mismatch`.
        seconds: duration [s].
        seed: of robot, hits and noise.
        conditions: hidden effects, friction, disturbances, sampling.
        options: what is compared.
        progress: called with a text and the share done.
        say: called before the first run with a sentence for each controller that makes the model's loop unstable.

    Raises:
        SimulationError: an option is impossible, or a simulation diverged.
        RobotError: the model is of another robot.
    """
    conditions, options = conditions or Conditions(), options or LoopOptions()
    own = robot.name in ROBOTS
    controllers = options.controllers or (tuple(RECIPES) if own else USUAL)
    motion = options.motion or ("moves" if own else "hits")
    pairs = [(controller, source) for controller in controllers for source in options.sources]
    occasion = Occasion(robot, motion, seconds, seed, conditions)
    nominal = true_robot(robot, {})
    told = (
        f"robot file {model.path.name}"
        if model
        else f"the truth, parameters off by {100 * options.mismatch:g} % (1 sigma)"
    )
    model = model or _nearly_true(nominal, occasion, options.mismatch, seed)
    _check_same_robot(robot, model)
    plan = PLANS[motion](nominal, occasion.times, occasion.start, occasion.random("targets"))
    rehearsal = _Rehearsal(nominal, model, plan, _planned_head(occasion.engine, nominal, plan.q), options)
    unstable = tuple(line for name in controllers for line in rehearsal.growing(name))
    for line in unstable:
        say(line)
    runs = []
    for k, pair in enumerate(pairs):
        share = partial(_report, progress, k, len(pairs), f"{CONTROLLERS[pair[0]]}, {SOURCES[pair[1]]}")
        runs.append(rehearsal.run(*pair, Occasion(robot, motion, seconds, seed, conditions), share))
    return ClosedLoopResult(
        robot,
        model,
        plan,
        rehearsal.head,
        full_command(model),
        tuple(runs),
        occasion.told(),
        options.lag,
        options.cutoff,
        options.mismatch,
        told,
        unstable,
    )


class _Rehearsal:
    """All that the runs have in common."""

    def __init__(self, nominal: Robot, model: Robot, plan: Plan, head: Array, options: LoopOptions):
        self.head = head
        self._model, self._plan, self._options = model, plan, options
        self._reference = model_reference(model, plan.times, plan.q, plan.v, plan.a)
        still = np.zeros_like(plan.q)
        self._motors = model_reference(nominal, plan.times, plan.q, still, still).x[:, nominal.layout.motor_q]
        self._feedback: StateFeedback | None = None

    def law(self, name: str) -> ControlLaw:
        """A controller that has not seen anything yet."""
        if name == "p":
            return ProportionalControl(self._model, self._plan)
        if name == "state_feedback":
            self._feedback = self._feedback or StateFeedback(self._model, self._reference, TICK)
            return self._feedback
        return FlexibleJointControl(self._model, self._plan, RECIPES[name])

    def growing(self, name: str) -> list[str]:
        """A sentence if the gains of a controller make the model's loop unstable."""
        law = self.law(name)
        if not isinstance(law, FlexibleJointControl):
            return []
        rate, frequency = growth(self._model, self._reference.x[0], law.gain, TICK)
        if rate <= 0.0:
            return []
        return [
            f"{CONTROLLERS[name]}: its gains make the model unstable at home: a swing of {frequency:.1f} Hz grows by "
            f"{100 * np.expm1(min(rate, 50.0)):.3g} % a second; lower them or use another controller"
        ]

    def run(self, controller: str, source: str, occasion: Occasion, report: Callable[[float], None]) -> LoopRun:
        """One controller with one source on an occasion that nothing has moved yet."""
        model, plan = self._model, self._plan
        knows = self._source(source, occasion)
        loop = Loop(OnlineSensors(occasion.sensors()), knows, self.law(controller), model, len(plan.times))
        with _garbage_left_alone():
            trajectory = occasion.run(loop, report)
        states, _ = occasion.states(trajectory)
        head = _head(occasion.engine, occasion.truth, occasion.at_ticks(trajectory.q))
        known = model.layout.by_joint(loop.estimates)
        off = joint_angles(model, states[:, 2 * model.n : 3 * model.n] - self._motors)
        errors = tracking(plan, self.head, off, states, head, known, loop.commands, full_command(model))
        recording = occasion.recording(trajectory, loop.commands)
        account = knows.account() if isinstance(knows, EstimatedState) else None
        return LoopRun(controller, source, states, known, loop.commands, head, errors, recording, account)

    def _source(self, name: str, occasion: Occasion) -> StateSource:
        model, options = self._model, self._options
        if name == "true":
            return TrueState(model, occasion.engine)
        if name == "encoders":
            return DifferentiatedEncoders(model, self._reference, options.cutoff)
        return EstimatedState(options.make_estimator(model, options.lag), self._reference)


@contextmanager
def _garbage_left_alone() -> Iterator[None]:
    """As a control loop does: what is there already is not searched for garbage while the loop runs."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _report(progress: Progress | None, k: int, count: int, label: str, share: float) -> None:
    if progress is not None:
        progress(label, (k + share) / count)


def _nearly_true(nominal: Robot, occasion: Occasion, mismatch: float, seed: int) -> Robot:
    """What a good calibration without hidden effects would know: mounting as it is, parameters a little off."""
    rng = random_stream(seed, "mismatch")
    off = np.exp(mismatch * rng.standard_normal(len(nominal.parameters)))
    values = {p.name: p.value * factor for p, factor in zip(nominal.parameters.values(), off, strict=True)}
    gyros: dict[str, Sensor] = {
        gyro.sensor.name: replace(gyro.sensor, R_imu_body=gyro.R_imu_body, R_prior=gyro.R_imu_body)
        for gyro in occasion.gyros
    }
    return nominal.with_values(values).with_sensors(gyros)


def _check_same_robot(robot: Robot, model: Robot) -> None:
    for what, expected, got in (
        ("joints", robot.joints, model.joints),
        ("sensors", tuple(robot.sensors), tuple(model.sensors)),
        ("command unit", (robot.command.unit,), (model.command.unit,)),
    ):
        if expected != got:
            raise RobotError(
                f"{model.path.name} is no model of {robot.name}: {what}: expected {', '.join(expected)}, "
                f"got {', '.join(got)}"
            )


def _planned_head(engine: Engine, robot: Robot, q_link: Array) -> Array:
    """Where the head is when the links are as planned and bearings do not yield, shape (m, 3) [m]."""
    q = np.zeros((len(q_link), engine.model.nq))
    q[:, engine.link] = q_link
    return _head(engine, robot, q)


def _head(engine: Engine, robot: Robot, q: Array) -> Array:
    """Where the last body's origin is, shape (m, 3) [m], at positions of all coordinates, shape (m, nq)."""
    tree = robot.tree
    frame = tree.model.frames[tree.frame_id(tree.bodies[-1])]
    return engine.points(tree.model.names[frame.parentJoint], np.asarray(frame.placement.translation), q)
