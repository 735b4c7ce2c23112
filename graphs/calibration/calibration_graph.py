# SPDX-License-Identifier: BSD-3-Clause
"""The graph of a finished calibration, for programs that go on with GTSAM: factors of their own, other optimizers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import gtsam
import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.factors.single import block_key, extract_calibration, state_key
from jointscope.graphs.calibration.calibration_result import CalibrationResult
from jointscope.graphs.gtsam_solvers.reference_graph import (
    initial_values,
    marquardt_parameters,
    nonlinear_graph,
    unsolvable,
)
from jointscope.graphs.gtsam_solvers.users_factor import what_is_wrong
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.condensed_graph import STRETCH, CondensedGraph
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.set_problem import Problem, motions, motions_only
from jointscope.graphs.solving.stretch import RecordingStretch
from jointscope.robots.errors import SolveError

Array = NDArray[np.float64]

MOST_SHOWN = 24  # stretches of motion: a graph is printed for a user
INNER_STEPS = 10  # two or three are taken where friction reverses


@dataclass(frozen=True)
class CalibrationGraph:
    """A calibration as GTSAM sees it.

    Attributes:
        graph: all factors; add your own.
        values: where the calibration ended.
        keys: of the shared blocks by name ("dynamics", "imu1.rotation", "imu1.bias", of a second recording
            "imu1.bias (bag 2)"), then of the states by recording and time ("x 12.000 s", "x 0.500 s (bag 2)").
        like: any calibration of the robot; gives names and kinds of the parameters.
        kinds: of the recordings of the first factors, "motion", "rests", "poses" or "frequency"; the others are priors.
        own: how many factors are those of the calibration; those that follow are the user's.
    """

    graph: gtsam.NonlinearFactorGraph
    values: gtsam.Values
    keys: Mapping[str, int]
    like: Calibration
    kinds: tuple[str, ...] = ()
    own: int = 0

    @staticmethod
    def of(result: CalibrationResult, per_sample: bool = False) -> CalibrationGraph:
        """The graph of a calibration.

        Args:
            result: what `calibrate` returned.
            per_sample: one factor for every sample instead of condensed ones; GTSAM's optimizers then take a time that
                grows with the square of the samples, as they copy all values for each of their callbacks.

        Raises:
            SolveError: a factor for every sample, and recordings of other kinds than motion.
        """
        robot = replace(result.robot, noise=result.noise)  # the file's is that of a filter, with standstills
        motion = [BagProblem.of(robot, bag.recording, bag.ticks) for bag in result.bags]
        problems: list[Problem] = [*motion, *(other.of_robot(robot) for other, _, _ in result.sets)]
        estimate = Estimate(
            tuple(bag.states for bag in result.bags) + tuple(x for _, x, _ in result.sets),
            tuple(bag.calibration for bag in result.bags) + tuple(known for *_, known in result.sets),
        )
        if not per_sample:
            return CalibrationGraph.of_problems(problems, estimate)
        motion = motions_only(problems, "a factor for every sample (per_sample)")
        graph, values = nonlinear_graph(motion, estimate), initial_values(estimate)
        keys = _keys(problems, estimate, values)
        return CalibrationGraph(graph, values, keys, estimate.calibrations[0], own=graph.size())

    @staticmethod
    def of_problems(problems: Sequence[Problem], estimate: Estimate) -> CalibrationGraph:
        """The graph of recordings of any kinds, one condensed factor for each that is no motion.

        Args:
            problems: the recordings.
            estimate: where their calibration ended.
        """
        steps = sum(len(problem.dynamics) for problem in motions(problems))
        condensed, values = CondensedGraph.of(problems, estimate, length=max(STRETCH, -(-steps // MOST_SHOWN)))
        for stretch in (stretch for cuts in condensed.stretches for stretch in cuts):
            if isinstance(stretch, RecordingStretch):  # so that an error depends on its values alone
                stretch.begin_here(INNER_STEPS)
        keys = _keys(problems, estimate, values)
        names = ["motion" if isinstance(problem, BagProblem) else problem.kind for problem in problems]
        kinds = [name for name, cuts in zip(names, condensed.stretches, strict=True) for _ in cuts]
        own = condensed.graph.size()
        return CalibrationGraph(condensed.graph, values, keys, estimate.calibrations[0], tuple(kinds), own)

    def coordinate(self, parameter: str) -> int:
        """Place of a parameter in the block "dynamics", which holds positive ones as logarithms.

        Raises:
            SolveError: no such parameter is free.
        """
        if parameter not in self.like.names:
            raise SolveError(f"no free parameter {parameter!r} in the graph; it has {', '.join(self.like.names)}")
        return self.like.names.index(parameter)

    def parameters(self, values: gtsam.Values) -> dict[str, float]:
        """Values of all free parameters in their units, by name."""
        found = extract_calibration(values, self.like, (DYNAMICS,))
        return found.by_name

    def sigmas(self, values: gtsam.Values) -> dict[str, float]:
        """Standard deviations of all free parameters in their units, by `gtsam.Marginals`.

        Raises:
            SolveError: as `optimize` says.
        """
        self._check(values)
        try:
            covariance = gtsam.Marginals(self.graph, values).marginalCovariance(self.keys[DYNAMICS])
        except (RuntimeError, ValueError) as err:
            raise unsolvable(err, self._names) from err
        slopes = extract_calibration(values, self.like, (DYNAMICS,)).value_by_coordinate
        return dict(zip(self.like.names, (np.sqrt(np.diag(covariance)) * slopes).tolist(), strict=True))

    def optimize(self) -> gtsam.Values:
        """The minimum of the graph as it is now, by `gtsam.LevenbergMarquardtOptimizer` from `values`.

        Raises:
            SolveError: a factor has a key that the graph's values lack, or no finite error, or nothing determines a
                variable.
        """
        self._check(self.values)
        parameters = marquardt_parameters()
        parameters.setOrdering(self.ordering)
        try:
            return gtsam.LevenbergMarquardtOptimizer(self.graph, self.values, parameters).optimize()
        except (RuntimeError, ValueError) as err:
            raise unsolvable(err, self._names) from err

    @property
    def ordering(self) -> gtsam.Ordering:
        """States in the order of time, then shared blocks, then what a user added."""
        shared = [key for name, key in self.keys.items() if not name.startswith("x ")]
        states = [key for name, key in self.keys.items() if name.startswith("x ")]
        known = {*shared, *states}
        ordering = gtsam.Ordering()
        for key in (*states, *shared, *(key for key in self.values.keys() if key not in known)):
            ordering.push_back(key)
        return ordering

    def without_states(self, values: gtsam.Values | None = None) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """What the recordings say about the shared blocks alone: a small linear graph about some values, and these.

        The states are eliminated; what is left is a graph of `gtsam.LinearContainerFactor`; others may be added.

        Raises:
            SolveError: as `optimize` says.
        """
        values = self.values if values is None else values
        self._check(values)
        states = gtsam.Ordering()
        for name, key in self.keys.items():
            if name.startswith("x "):
                states.push_back(key)
        try:
            _, rest = self.graph.linearize(values).eliminatePartialSequential(states)
        except (RuntimeError, ValueError) as err:
            raise unsolvable(err, self._names) from err
        shared = gtsam.Values(values)
        for i in range(states.size()):
            shared.erase(states.at(i))
        return gtsam.LinearContainerFactor.ConvertLinearGraph(rest, shared), shared

    def describe(self) -> str:
        """The factors, a line each, with the names of their variables."""
        names = self._names
        lines = [f"{self.graph.size()} factors on {self.values.size()} variables"]
        for i in range(self.graph.size()):
            factor = self.graph.at(i)
            touched = [names.get(key, gtsam.DefaultKeyFormatter(key)) for key in factor.keys()]
            kind = self.kinds[i] if i < len(self.kinds) and len(set(self.kinds)) > 1 else ""
            lines.append(f"{i:4d}  {factor.dim()} rows{kind and f' of {kind}'}: {', '.join(touched)}")
        return "\n".join(lines)

    @property
    def _names(self) -> dict[int, str]:
        return {key: name for name, key in self.keys.items()}

    def _check(self, values: gtsam.Values) -> None:
        """Raises SolveError where a factor, as a rule one of the user's, cannot be used at some values."""
        zero, names = values.zeroVectors(), self._names
        for i in range(self.graph.size()):
            factor = self.graph.at(i)
            missing = [key for key in factor.keys() if not values.exists(key)]
            if missing:
                raise SolveError(
                    f"factor {i} touches {gtsam.DefaultKeyFormatter(missing[0])}, which the graph's values lack; "
                    f"insert a start value for it into `values`, or use one of `keys`: {', '.join(self.keys)}"
                )
            if i < self.own:
                continue
            sizes = {key: zero.dim(key) for key in factor.keys()}
            if wrong := what_is_wrong(
                factor, values, sizes, lambda key: names.get(key, gtsam.DefaultKeyFormatter(key))
            ):
                touched = ", ".join(gtsam.DefaultKeyFormatter(key) for key in factor.keys())
                raise SolveError(f"factor {i} on {touched} {wrong}")
        # GTSAM's optimizer returns its start as if nothing were wrong
        if not np.isfinite(self.graph.error(values)):
            raise SolveError(
                "the recordings have no finite error at these values; expected start values near those of the "
                "calibration, which are in `values`"
            )


class Keys(dict[str, int]):
    """Keys of variables by name; an unknown name is told with those that there are."""

    def __missing__(self, name: str) -> int:
        raise SolveError(f"no variable {name!r} in the graph; it has {', '.join(self)}")


def _keys(problems: Sequence[Problem], estimate: Estimate, values: gtsam.Values) -> Keys:
    return Keys(_block_keys(estimate.calibrations, values) | _state_keys(problems, values))


def _block_keys(calibrations: Sequence[Calibration], values: gtsam.Values) -> dict[str, int]:
    keys: dict[str, int] = {}
    for bag, calibration in enumerate(calibrations):
        for block in calibration.blocks:
            key = block_key(block, calibration, bag)
            if key not in keys.values() and values.exists(key):
                keys[block if bag == 0 else f"{block} (bag {bag + 1})"] = key
    return keys


def _state_keys(problems: Sequence[Problem], values: gtsam.Values) -> dict[str, int]:
    keys = {}
    for bag, problem in enumerate(problems):
        if not isinstance(problem, BagProblem):
            continue  # its states are inside its factor
        behind = "" if bag == 0 else f" (bag {bag + 1})"
        for tick, time in enumerate(problem.timeline.ticks.tolist()):
            key = state_key(tick, bag)
            if values.exists(key):
                keys[f"x {time:.4f} s{behind}"] = key
    return keys
