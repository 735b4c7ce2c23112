# SPDX-License-Identifier: BSD-3-Clause
"""How long a calibration takes, beside single shooting and the plain callback graph on the same recordings."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import elimination
from callback_graph import Cost, batch_iteration, near_solution, optimizer_iteration, python_loop_iteration
from graph_overhead import graph_overhead
from patience import say
from simulated_bags import largest_error, simulated_bag
from single_shooting import SingleShooting
from tables import Section, Table

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import read_recording

SHARE = 0.5  # of the recording's own duration
MEMORY = 6.0  # [GiB]
GROWTH = 2.3  # time of the double length over that of the single
OVERHEAD = 1.1  # of GTSAM's graph over the band alone
GIB = 1024.0**3
STARTS = {"regression of calibrate": True, "values of the robot file": False}
SOLVERS = {"MINPACK": "lm", "trust region": "trf"}  # the first is faster, the second gets home from farther away
SLICE_START = 2.0  # [s] the robot moves by then


def run(quick: bool) -> Section:
    """65 s and 130 s at 1 kHz; `quick` takes 5 s and 10 s, for which nothing is promised."""
    lengths = (5.0, 10.0) if quick else (65.0, 130.0)
    section = Section(
        "Speed",
        "Simulated calibration motion at 1 kHz, smooth friction, every sample a state; each calibration in a process "
        "of its own. Times are wall clock, from the recording to all values, states and their sigmas.",
    )
    took = {seconds: _calibrate(section, seconds, promised=not quick) for seconds in lengths}
    growth = took[lengths[1]]["wall_seconds"] / took[lengths[0]]["wall_seconds"]
    target, met = (f"at most {GROWTH:g} times", growth <= GROWTH) if not quick else ("", None)
    section.promise(f"{lengths[1]:g} s against {lengths[0]:g} s", target, f"{growth:.2f} times", met)
    if quick:
        section.notes.append("Quick run on short recordings: the targets are for 65 s and 130 s, so none is judged.")
    bag, truth = simulated_bag(lengths[0])
    robot = load_robot("doggy")
    recording = read_recording(bag, robot)
    section.tables.append(_single_shooting(section, robot, recording, truth, took[lengths[0]]))
    start = robot.with_values({name: truth[name] for name in robot.parameters})
    section.tables += _callback_graph(section, start, recording, quick)
    section.tables.append(_elimination(section, start, recording, 2.0 if quick else 5.0))
    _graph_overhead(section, start, recording)
    return section


def _calibrate(section: Section, seconds: float, promised: bool) -> dict[str, Any]:
    """One calibration in its own process."""
    bag, truth = simulated_bag(seconds)
    say(f"speed: calibrating {seconds:g} s")
    child = Path(__file__).with_name("timed_calibration.py")
    started = time.perf_counter()
    done = subprocess.run([sys.executable, str(child), str(bag)], capture_output=True, text=True, check=False)
    whole = time.perf_counter() - started
    if done.returncode != 0:
        raise RuntimeError(f"the calibration of {seconds:g} s failed:\n{done.stderr}")
    took = json.loads(done.stdout)
    took["process_seconds"] = whole
    took["largest_error"] = largest_error(took["parameters"], truth)
    limit, wall, gib = SHARE * seconds, took["wall_seconds"], took["peak_bytes"] / GIB
    label = f"{seconds:g} s, {took['state_unknowns']:,} state unknowns"
    section.promise(
        f"{label}: calibrated in",
        f"below {limit:g} s" if promised else "",
        f"{wall:.1f} s (CPU {took['cpu_seconds']:.1f} s, {took['iterations']} iterations)",
        wall < limit if promised else None,
    )
    section.promise(
        "&nbsp;&nbsp;peak memory",
        f"below {MEMORY:g} GiB" if promised else "",
        f"{gib:.2f} GiB",
        gib < MEMORY if promised else None,
    )
    measured = f"{whole:.1f} s (reading {took['read_seconds']:.1f} s)"
    section.promise("&nbsp;&nbsp;whole process, imports and reading the bag included", "", measured)
    name, error = took["largest_error"]
    z = (took["parameters"][name] - truth[name]) / took["sigmas"][name]
    section.promise("&nbsp;&nbsp;largest error of the 12 parameters", "", f"{error:.3f} % ({name}, {z:+.1f} sigma)")
    section.numbers[f"{seconds:g} s"] = took
    return took


def _single_shooting(
    section: Section, robot: Robot, recording: Recording, truth: Mapping[str, Any], ours: Mapping[str, Any]
) -> Table:
    """Least squares of scipy on simulations by numba, from two starts with two methods."""
    say("speed: single shooting, compiling")
    shooting = SingleShooting(robot, recording)
    name, error = ours["largest_error"]
    rows = [
        ("jointscope", f"{ours['wall_seconds']:.1f} s", f"{ours['iterations']}", "yes", f"{error:.3f} % ({name})", "")
    ]
    for (words, regression), (solver, method) in itertools.product(STARTS.items(), SOLVERS.items()):
        say(f"speed: single shooting from the {words}, {solver}")
        shot = shooting.fit(shooting.start(regression), method)
        name, error = largest_error(dict(zip(robot.parameters, shot.parameters, strict=True)), truth)
        label = f"single shooting from the {words}, {solver}"
        cells = (f"{shot.seconds:.1f} s", f"{shot.jacobians}", "yes" if shot.converged else "no")
        rows.append((label, *cells, f"{error:.3g} % ({name})", f"{shot.rms:.3f}"))
        section.numbers[label] = asdict(shot) | {"parameters": shot.parameters.tolist()}
    head = ("method", "wall time", "iterations", "converged", "largest error", "rms residual [sigma]")
    section.notes.append(
        "Single shooting gets a recording without any disturbance, all cores and no compile time; it has no process "
        "noise, and gives neither states nor their sigmas."
    )
    return Table(f"Single shooting (numba, scipy) on the same {recording.duration + 1e-3:.0f} s", head, rows)


def _callback_graph(section: Section, robot: Robot, recording: Recording, quick: bool) -> list[Table]:
    """Cost of one iteration on short slices, from both ends."""
    loop_lengths = (0.5, 1.0) if quick else (0.5, 1.0, 2.0, 4.0)
    optimizer_lengths = (0.25, 0.5) if quick else (0.25, 0.5, 1.0)
    rows: dict[str, list[tuple[str, ...]]] = {"loop": [], "optimizer": []}
    for seconds in sorted({*loop_lengths, *optimizer_lengths}):
        say(f"speed: callback graph, {seconds:g} s")
        problem, estimate = near_solution(robot, _slice(recording, seconds))
        ours = batch_iteration(problem, estimate)
        kept = {"batch": asdict(ours)}
        if seconds in loop_lengths:
            cost = python_loop_iteration(problem, estimate)
            rows["loop"].append(_cost_row(seconds, cost, ours))
            kept["loop"] = asdict(cost)
        if seconds in optimizer_lengths:
            cost = optimizer_iteration(problem, estimate)
            cells = (
                f"{seconds:g} s",
                f"{cost.total:.3f} s",
                f"{cost.total / seconds:.2f} s",
                f"{1e3 * ours.total:.1f} ms",
            )
            rows["optimizer"].append((*cells, f"{cost.total / ours.total:.0f}"))
            kept["optimizer"] = asdict(cost)
        section.numbers[f"iteration, {seconds:g} s"] = kept
    loop = ("recording", "linearize", "eliminate", "sum per second of recording", "ours, whole iteration", "ratio")
    optimizer = ("recording", "one iteration", "per second of recording", "ours, whole iteration", "ratio")
    return [
        Table(
            "Callback per sample, loop in Python over graph.linearize and optimize: one iteration", loop, rows["loop"]
        ),
        Table(
            "Callback per sample inside gtsam.LevenbergMarquardtOptimizer: one iteration", optimizer, rows["optimizer"]
        ),
    ]


def _cost_row(seconds: float, cost: Cost, ours: Cost) -> tuple[str, ...]:
    parts = (
        f"{seconds:g} s",
        f"{cost.linearize:.3f} s",
        f"{1e3 * cost.eliminate:.1f} ms",
        f"{cost.total / seconds:.2f} s",
    )
    return (*parts, f"{1e3 * ours.total:.1f} ms", f"{cost.total / ours.total:.0f}")


def _elimination(section: Section, robot: Robot, recording: Recording, seconds: float) -> Table:
    """The linear system alone."""
    say("speed: elimination alone")
    times = elimination.measure(*near_solution(robot, _slice(recording, seconds)))
    whole = times.accumulate + times.banded
    rows = [_elimination_row("normal equations and banded LAPACK", whole, times.ticks, whole)]
    rows += [_elimination_row(f"GTSAM, {name}", t, times.ticks, whole) for name, t in times.gtsam.items()]
    section.numbers["elimination"] = asdict(times)
    section.notes.append(
        f"Both eliminations start from the same linearised factors and their steps agree to {times.difference:.0e}; "
        "making GTSAM's factor objects in Python is not counted."
    )
    head = ("solver", "time", "per tick", "ratio")
    return Table(f"Linear system of {times.ticks} states, from linearised factors to the step", head, rows)


def _graph_overhead(section: Section, robot: Robot, recording: Recording) -> None:
    """One iteration by GTSAM over condensed factors against one by a single band."""
    say("speed: GTSAM's graph against the band alone")
    found = graph_overhead(*near_solution(robot, recording))
    ratio = found.graph / found.band
    section.promise(
        f"one iteration of the GTSAM graph ({found.factors} factors, {found.ticks:,} states) against the band alone",
        f"at most {OVERHEAD:g} times",
        f"{ratio:.2f} times (CPU {found.graph:.2f} s)",
        ratio <= OVERHEAD,
    )
    section.numbers["graph overhead"] = asdict(found)


def _elimination_row(name: str, seconds: float, ticks: int, reference: float) -> tuple[str, ...]:
    return (name, f"{1e3 * seconds:.1f} ms", f"{1e6 * seconds / ticks:.1f} us", f"{seconds / reference:.2f}")


def _slice(recording: Recording, seconds: float) -> Recording:
    start = min(SLICE_START, recording.duration - seconds)
    return recording.between(start, start + seconds)
