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
REPEATS = 2


def run(quick: bool) -> Section:
    """Four recordings of 6 s, in one process and on two workers; `quick` takes 3 s."""
    from distributed import LocalCluster

    seconds, robot = (3.0 if quick else 6.0), load_robot("doggy")
    say("cluster: simulating")
    moves = [seconds + 0.1 * k for k in range(RECORDINGS - 1)]
    made = [simulate(robot, "moves", length, seed=2, friction="smooth").recording for length in moves]
    recordings = [simulate(robot, "calibration", seconds, seed=2, friction="smooth").recording, *made]
    section = Section(
        "Several workers",
        f"{RECORDINGS} recordings of Doggy of {seconds:g} s at 1 kHz. *Iterations*: {ITERATIONS} of the batch solver "
        "on all samples, the recordings sent to workers that run already; the best of "
        f"{REPEATS}, taken in turn. *computing*: of this process and the busiest worker, what "
        "they would take with a core for each. *calibrate*: the whole verb but reading, once. Two workers on a machine "
        f"of {len(os.sched_getaffinity(0))} cores, which had other work, too: load is what ran or waited for a core on "
        "average at the end of each calibration.",
    )
    local = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with LocalProcesses(2) as processes, local, DaskCluster(local.scheduler_address) as cluster:
        solvers: dict[str, Solver] = {
            "one process": solve,
            "two processes": SpreadSolver(processes),
            "Dask, two workers here": SpreadSolver(cluster),
        }
        section.tables.append(_table(section, robot, recordings, solvers))
    return section


def _table(section: Section, robot: Robot, recordings: list[Recording], solvers: dict[str, Solver]) -> Table:
    """Times and ratios; the largest relative difference of a parameter from that of one process."""
    what = {where: _iterations(robot, recordings, solver) for where, solver in solvers.items()}
    best, computing = dict.fromkeys(solvers, np.inf), dict.fromkeys(solvers, np.inf)
    for k in range(REPEATS + 1):  # in the first, kernels are compiled
        for where, iterations in what.items():
            say(f"cluster: {where}, iterations")
            taken, needed = _seconds(iterations, solvers[where])
            if k:
                best[where], computing[where] = min(best[where], taken), min(computing[where], needed)
    table = Table(
        "Time",
        ("where", "iterations", "ratio", "computing", "ratio", "calibrate", "ratio", "load", "largest difference"),
        [],
    )
    whole, values = dict[str, float](), dict[str, np.ndarray]()
    for where, solver in solvers.items():
        say(f"cluster: {where}, calibrate")
        started = time.perf_counter()
        found = calibrate(robot, recordings, solver=solver)
        whole[where], load = time.perf_counter() - started, os.getloadavg()[0]
        values[where] = np.array([p.value for p in found.parameters])
        one, first = next(iter(solvers)), next(iter(values.values()))
        difference = float(np.max(np.abs(values[where] - first) / np.maximum(np.abs(first), 1e-12)))
        pairs = [(times[one], times[where]) for times in (best, computing, whole)]
        times = [text for alone, own in pairs for text in (f"{own:.1f} s", f"{alone / own:.2f}")]
        table.rows.append((where, *times, f"{load:.1f}", f"{difference:.1g}"))
        section.numbers[where] = {
            "iterations": best[where],
            "computing": computing[where],
            "calibrate": whole[where],
            "load": load,
        }
        section.numbers[where]["difference"] = difference
    return table


def _iterations(robot: Robot, recordings: list[Recording], solver: Solver) -> Callable[[], None]:
    problems = [BagProblem.of(robot, recording) for recording in recordings]
    calibrations = [initial_biases(problem, Calibration.of(robot)) for problem in problems]
    states = [initial_states(problem, known) for problem, known in zip(problems, calibrations, strict=True)]
    start = Estimate(tuple(states), tuple(calibrations))

    @in_solver_context
    def iterations() -> None:
        solver(problems, start, max_iterations=ITERATIONS, hold=(), progress=None)

    return iterations


def _seconds(what: Callable[[], None], solver: Solver) -> tuple[float, float]:
    """Time by the clock, and time of a processor, of this process and of the busiest worker [s]."""
    workers, own, started = _busy(solver), time.process_time(), time.perf_counter()
    what()
    seconds, here = time.perf_counter() - started, time.process_time() - own
    return seconds, here + float(np.max(_busy(solver) - workers, initial=0.0))


def _busy(solver: Solver) -> np.ndarray:
    """Time that each worker has computed so far, shape (workers,) [s]."""
    if not isinstance(solver, SpreadSolver):
        return np.zeros(0)
    return np.array([solver.crew.submit(slot, time.process_time).result() for slot in range(solver.crew.slots)])
