# SPDX-License-Identifier: BSD-3-Clause
"""How much two workers gain on several recordings, and whether they come to the same result."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np
from patience import say
from tables import Section, Table

from jointscope.factors.calibration import Calibration
from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.graphs.solving.batch_solver import Solver, solve
from jointscope.graphs.solving.estimate import Estimate
from jointscope.graphs.solving.solver_context import in_solver_context
from jointscope.graphs.spread.spread_solver import SpreadSolver
from jointscope.graphs.starts.initial_guess import initial_biases, initial_states
from jointscope.graphs.workers.dask_cluster import DaskCluster
from jointscope.graphs.workers.local_processes import LocalProcesses
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.simulator import simulate

RECORDINGS = 4
ITERATIONS = 6


Run = tuple[float, float, float, np.ndarray]
"""Time of the iterations and of a calibration [s], load, and the values found."""


def run(quick: bool) -> Section:
    """Four recordings of 10 s, in one process and on two workers; `quick` takes 3 s."""
    from distributed import LocalCluster

    seconds, robot = (3.0 if quick else 10.0), load_robot("doggy")
    say("cluster: simulating")
    made = [
        simulate(robot, "moves", seconds + 0.1 * k, seed=2, friction="smooth").recording for k in range(RECORDINGS - 1)
    ]
    recordings = [simulate(robot, "calibration", seconds, seed=2, friction="smooth").recording, *made]
    section = Section(
        "Several workers",
        f"{RECORDINGS} recordings of Doggy of {seconds:g} s at 1 kHz. *Iterations*: {ITERATIONS} of the batch solver "
        "on all samples, with the recordings sent to workers that run already; *calibrate*: the whole verb but reading. "
        f"Two workers on a machine of {len(os.sched_getaffinity(0))} cores; load is what waits for a core on average "
        "while it runs, this run included.",
    )
    head = ("where", "iterations", "ratio", "calibrate", "ratio", "load", "largest difference of a parameter")
    section.tables.append(Table("Four recordings", head, []))
    alone = _measured(robot, recordings, solve)
    _tell(section, "one process", alone, alone)
    with LocalProcesses(2) as crew:
        _tell(section, "two processes", _measured(robot, recordings, SpreadSolver(crew)), alone)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with DaskCluster(cluster.scheduler_address) as crew:
            _tell(section, "Dask, two workers here", _measured(robot, recordings, SpreadSolver(crew)), alone)
    return section


def _measured(robot: Robot, recordings: list[Recording], solver: Solver) -> Run:
    """Time of the iterations and of a calibration [s], load, and the values found."""
    say(f"cluster: {type(solver).__name__}")
    iterations = _iterations(robot, recordings, solver)
    iterations()  # workers begin, kernels are compiled
    first = _seconds(iterations)
    started = time.perf_counter()
    found = calibrate(robot, recordings, solver=solver)
    seconds = time.perf_counter() - started
    return first, seconds, os.getloadavg()[0], np.array([p.value for p in found.parameters])


def _iterations(robot: Robot, recordings: list[Recording], solver: Solver) -> Callable[[], None]:
    problems = [BagProblem.of(robot, recording) for recording in recordings]
    calibrations = [initial_biases(problem, Calibration.of(robot)) for problem in problems]
    states = [initial_states(problem, known) for problem, known in zip(problems, calibrations, strict=True)]
    start = Estimate(tuple(states), tuple(calibrations))

    @in_solver_context
    def iterations() -> None:
        solver(problems, start, max_iterations=ITERATIONS, hold=(), progress=None)

    return iterations


def _seconds(what: Callable[[], None]) -> float:
    started = time.perf_counter()
    what()
    return time.perf_counter() - started


def _tell(
    section: Section,
    where: str,
    own: Run,
    alone: Run,
) -> None:
    difference = float(np.max(np.abs(own[3] - alone[3]) / np.maximum(np.abs(alone[3]), 1e-12)))
    ratios = alone[0] / own[0], alone[1] / own[1]
    times = f"{own[0]:.1f} s", f"{ratios[0]:.2f}", f"{own[1]:.1f} s", f"{ratios[1]:.2f}"
    section.tables[0].rows.append((where, *times, f"{own[2]:.1f}", f"{difference:.1g}"))
    section.numbers[where] = {"iterations": own[0], "calibrate": own[1], "load": own[2], "difference": difference}
