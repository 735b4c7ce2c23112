# SPDX-License-Identifier: BSD-3-Clause
"""The second half of a calibration: all samples of all recordings, with the noise that they ask for.

Where an encoder is too coarse or too slow to show when a joint turns over, dry friction has many minima in the states.
Then the law is blunt at first and becomes sharp step by step, and the process noise that was found from above is tried
from below: a smaller one that agrees with its own residuals is the better explanation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.stages.convergence_asked import must_converge
from jointscope.graphs.calibration.stages.history import History
from jointscope.graphs.calibration.stages.near_solution import NearSolution
from jointscope.graphs.calibration.stages.solved import Solved
from jointscope.graphs.calibration.stages.solved_windows import anchored, noise_windows
from jointscope.graphs.noise.noise_estimation import FixedPoint, densities, not_below, scaled
from jointscope.graphs.noise.torque_memory import likeliest_memory
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import Progress, Solution, Solver, first_step, solve
from jointscope.graphs.solving.convergence import measured_rows
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import Problem, SetProblem
from jointscope.graphs.starts.encoder_motion import hides_reversals
from jointscope.graphs.starts.initial_guess import initial_states
from jointscope.graphs.starts.memory_start import with_filled_memories
from jointscope.robots.errors import SolveError
from jointscope.robots.model.robot import Robot
from jointscope.robots.parts.process_noise import ProcessNoise
from jointscope.robots.recordings.recording import Recording

Array = NDArray[np.float64]

LOOSE = 0.3  # [rad/s/sqrt(s)] densities at which every calibration begins; the paper's are 0.35 and 0.26
APPROACH = 1.0 / 6.0  # [LOOSE] noise with which the whole recording is approached
NOISE_AGREES = 0.25  # relative difference of windows and whole recording that asks for no second pass
SIGMA_AGREES = 0.05  # the same for the sigma of an encoder
NOISE_PASSES = 10  # at the most; where the noise of the windows was right, one does
MOST_ITERATIONS = 100  # models that contradict the recording converge slowly
FEW_ITERATIONS = 12
NEAR = 0.5  # [sigma] a last step that is short enough for a start
NUISANCE = 0.3  # [sigma] biases need no more where the parameters are held
SMALL_STEP = 0.1  # [sigma] a last step that changes no value
BLUNT = (20.0, 60.0)  # [s/rad] friction sharpness on the way to that of the robot
BELOW_ITERATIONS = 25  # where it does not come to rest in as many, the larger noise stays
BELOW = 10.0  # times smaller process noise that is tried
BETTER = 1.5  # times smaller, the one that is preferred ...
AS_GOOD = 0.02  # ... where the cost rises by less than this per measured value


@dataclass(frozen=True)
class WholeStage:
    """How the whole recordings are solved.

    Attributes:
        hold: blocks that stay.
        history: receives the iterations.
        progress: called with a text and the share done.
        sigmas: whether the sigmas of encoders are estimated, too.
        solver: minimises the cost of all samples.
        sets: recordings of other kinds, which share the values of the motions from here on.
        stated: sigmas of encoders before any was found anew, by sensor, shape (n,) each; those at hand where empty.
        agrees: relative difference of noise and residuals that asks for no further pass.
        near: a point near the solution; None where states come from the measurements.
    """

    hold: tuple[str, ...]
    history: History
    progress: Progress
    sigmas: bool
    solver: Solver = solve
    sets: Sequence[SetProblem] = ()
    stated: Mapping[str, Array] = field(default_factory=dict)
    agrees: float = NOISE_AGREES
    near: NearSolution | None = None

    def solve(self, problems: Sequence[BagProblem], noise: ProcessNoise, calibrations: Sequence[Calibration]) -> Solved:
        """First with looser noise, then with the estimated one, checked against the whole."""
        return self.finished(problems, noise, self.approached(problems, noise, calibrations))

    def approached(
        self, problems: Sequence[BagProblem], noise: ProcessNoise, calibrations: Sequence[Calibration]
    ) -> Estimate:
        """Where looser noise and blunter friction lead from the values that windows found; near states are kept."""
        if self.near is not None and (states := self.near.states_of(problems)):
            return self.with_sets(Estimate(tuple(states), tuple(calibrations)))
        blunt = blunt_sharpness(problems[0].robot, [p.recording for p in problems])
        softer = [anchored([blunted(p, sharpness) for p in problems], calibrations) for sharpness in blunt]
        estimate = approach(softer[0] if softer else problems, noise, calibrations, self.hold)
        estimate = self.with_sets(estimate)
        for soft in softer:
            estimate = self.step("blunt friction", soft, noise, estimate, FEW_ITERATIONS).estimate
        return estimate

    def finished(self, problems: Sequence[BagProblem], noise: ProcessNoise, estimate: Estimate) -> Solved:
        """The solution with the noise that the whole asks for, approached from both sides where that is needed."""
        return self.with_short_impacts(self.from_both_sides(self.settled(problems, noise, estimate)))

    def with_short_impacts(self, solved: Solved) -> Solved:
        """The solution with short steps where springs meet edges of dead zones; blows else look like random torque."""
        problems, states, calibrations = solved.of_motions
        known = [c.by_name for c in calibrations]
        pairs = [p.divided(x, values) for p, x, values in zip(problems, states, known, strict=True)]
        now = anchored([p for p, _ in pairs], calibrations)
        if all(p is whole for (p, _), whole in zip(pairs, problems, strict=True)):
            return solved
        start = self.with_sets(Estimate(tuple(x for _, x in pairs), tuple(calibrations)))
        try:
            return self.settled(now, problems[0].dynamics.steps.noise, start)
        except SolveError:
            return solved

    def from_both_sides(self, above: Solved) -> Solved:
        """A solution, or a better one with less noise, where encoders do not show how joints turn over."""
        blunt = blunt_sharpness(above.robot, [p.recording for p in above.problems])
        return self._from_below(above) if blunt and above.robot.noise.estimate else above

    def with_memory(self, white: Solved) -> Solved:
        """The solution with random torques that last, where the recordings ask for them; else the one that is given."""
        if self.hold or not white.robot.noise.estimate:
            return white
        self.progress("memory of random torques", 0.9)
        estimate, motions = white.solution.estimate, len(white.problems)
        try:
            found = likeliest_memory(noise_windows(white))
            if found is None:
                return white
            robot, before = found.robot, white.robot.layout
            now = anchored([p.of_robot(robot) for p in white.problems], estimate.calibrations)
            states = [robot.layout.carried_over(x, before) for x in estimate.states[:motions]]
            start = self.with_sets(Estimate(tuple(states), estimate.calibrations[:motions]))
            return self.settled(now, robot.noise, start)
        except SolveError:
            return white

    def settled(
        self, problems: Sequence[BagProblem], noise: ProcessNoise, estimate: Estimate, most: int | None = None
    ) -> Solved:
        """A solution whose noise agrees with its residuals."""
        for found in self.passes(problems, noise, estimate, most):  # each is large, and the last one counts
            solved = found
        return solved

    def passes(
        self, problems: Sequence[BagProblem], noise: ProcessNoise, estimate: Estimate, most: int | None = None
    ) -> Iterator[Solved]:
        """Solutions on the way to one whose noise agrees with its residuals, which is the last."""
        updates = FixedPoint()
        for _ in range(NOISE_PASSES):
            solution = self.step("all samples", problems, noise, estimate, most or MOST_ITERATIONS)
            must_converge(solution, problems[0].robot, NUISANCE if self.hold else SMALL_STEP)
            self.progress("residuals and uncertainties", 0.9)
            solved = Solved.of([p.with_noise(noise) for p in problems], solution, self.hold, self._sets_of(problems))
            yield solved
            better = scaled(noise, solved.evidence.factors) if noise.estimate else noise
            change = np.log(densities(better) / densities(noise))
            # states that a large process noise lets follow the samples leave less of their noise than there is
            follow = bool(np.any(change < -NOISE_AGREES))
            other = _with_sigmas(problems, solved, self.stated) if self.sigmas and not follow else None
            if other is None and np.all(np.abs(change) < self.agrees):
                break
            noise = updates.update(noise, solved.evidence.factors) if noise.estimate else noise
            problems, estimate = other or problems, solution.estimate

    def _from_below(self, above: Solved) -> Solved:
        """The better of two solutions, where a smaller noise agrees with itself as well."""
        noise = above.problems[0].dynamics.steps.noise
        smaller = scaled(noise, np.full(len(densities(noise)), 1.0 / BELOW))
        if np.all(densities(noise) < BETTER * densities(smaller)):
            return above
        try:
            below = self.settled(above.problems, smaller, above.solution.estimate, BELOW_ITERATIONS)
        except SolveError:
            return above
        found = below.problems[0].dynamics.steps.noise
        rise = (below.solution.cost - above.solution.cost) / max(measured_rows(above.problems), 1)
        gained = float(np.sum(np.log(densities(noise) / densities(found))))
        return below if gained > np.log(BETTER) and rise < AS_GOOD else above

    def step(
        self, name: str, problems: Sequence[BagProblem], noise: ProcessNoise, estimate: Estimate, most: int
    ) -> Solution:
        """The solution for a given noise; arguments as in `settled`, `most` iterations are allowed."""
        now: list[Problem] = [*(p.with_noise(noise) for p in problems), *self._sets_of(problems)]
        solution = self.solver(now, estimate, max_iterations=most, hold=self.hold, progress=self.progress)
        self.history.add(name, solution)
        return solution

    def _sets_of(self, problems: Sequence[BagProblem]) -> list[SetProblem]:
        """The recordings of other kinds on the robot of the motions."""
        return [other.of_robot(problems[0].robot) for other in self.sets]

    def with_sets(self, estimate: Estimate) -> Estimate:
        """The estimate of the motions with states and blocks of the other kinds."""
        starts = [other.start(estimate.calibrations[0]) for other in self.sets]
        states, calibrations = [x for x, _ in starts], [c for _, c in starts]
        return Estimate((*estimate.states, *states), (*estimate.calibrations, *calibrations))


def blunt_sharpness(robot: Robot, recordings: Sequence[Recording]) -> tuple[float, ...]:
    """Friction sharpness of the stages before the robot's own, where encoders do not show how joints turn over."""
    encoder = robot.motor_encoder
    if not any(hides_reversals(recording.streams[encoder.name], encoder) for recording in recordings):
        return ()
    return tuple(sharpness for sharpness in BLUNT if sharpness < float(np.min(robot.friction_sharpness())))


def blunted(problem: BagProblem, sharpness: float) -> BagProblem:
    """The same recording on a robot whose friction turns over more slowly.

    Joints with a sharpness of their own keep it: it is a value that all stages look for, and its start says how sharp.
    """
    choices = replace(problem.robot.choices, friction_sharpness=sharpness)
    return problem.of_robot(replace(problem.robot, choices=choices))


def approach(
    problems: Sequence[BagProblem], noise: ProcessNoise, calibrations: Sequence[Calibration], hold: tuple[str, ...]
) -> Estimate:
    """One step over all samples with noise that is loose enough for states straight from the measurements.

    Where that one step leads away, as it may under a model that lacks much, several checked ones are taken.
    Accelerometers wait: an acceleration is a second difference of positions, and far from the solution its rows lead
    astray.
    """
    accelerometers = problems[0].robot.accelerometers
    plain = problems[0].robot.without(accelerometers)
    if plain is not problems[0].robot:
        without = [p.of_robot(p.robot.without(accelerometers)) for p in problems]
        known = [c.carried_to(Calibration.of(plain)) for c in calibrations]
        near = approach(without, noise, known, hold)
        return Estimate(
            near.states, tuple(c.carried_to(full) for c, full in zip(near.calibrations, calibrations, strict=True))
        )
    states = [initial_states(p, c) for p, c in zip(problems, calibrations, strict=True)]
    loose = not_below(noise, APPROACH * LOOSE)
    now = [p.with_noise(loose) for p in problems]
    start = with_filled_memories(now, Estimate(tuple(states), tuple(calibrations)), hold)
    found = first_step(now, start, hold)
    return found or solve(now, start, max_iterations=FEW_ITERATIONS, step_tolerance=NEAR, hold=hold).estimate


def _with_sigmas(
    problems: Sequence[BagProblem], solved: Solved, stated: Mapping[str, Array]
) -> list[BagProblem] | None:
    """The problems with the sigmas of encoders that the residuals ask for; None where all are as they were."""
    robot, changed = problems[0].robot, {}
    for encoder in (robot.motor_encoder, robot.link_encoder):
        if encoder is not None:
            found = solved.encoder_sigmas(encoder, stated.get(encoder.name, encoder.sigmas))
            if np.any(np.abs(np.log(found / encoder.sigmas)) > SIGMA_AGREES):
                changed[encoder.name] = replace(encoder, sigmas=found)
    if not changed:
        return None
    other = robot.with_sensors(changed)
    return anchored([problem.of_robot(other) for problem in problems], solved.solution.estimate.calibrations)
