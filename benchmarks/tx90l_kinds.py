# SPDX-License-Identifier: BSD-3-Clause
"""Poses and frequency responses of TX90Ls in one graph: the tip, sigmas, and what `discover` finds with both."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from jointscope.graphs.frequency.calibrate_frequency import calibrate_frequency
from jointscope.graphs.joint_kinds.calibrate_kinds import calibrate_kinds
from jointscope.graphs.joint_kinds.discover_arm import discover_arm
from jointscope.graphs.poses.calibrate_poses import calibrate_poses, placed
from jointscope.graphs.poses.tip_errors import tip_errors
from jointscope.robots.geometry.error_parameters import BEARING, STIFFNESS
from jointscope.robots.model.robot import Robot
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.bags.at_poses.read_shaken import read_shaken
from jointscope.tools.bags.at_poses.write_shaken import write_shaken
from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

Tell = Callable[[str], None]
CLEAN = (100, 110, 114, 115)  # seeds of arms to which nothing was done
FAULTS = (  # seed, what is hidden, parameter that tells its size, and its value there
    (101, "joint_elasticity@joint5:compliance=4e-5", "joint5.stiffness", 2.5e4),
    (111, "joint_elasticity@joint4:compliance=2e-5", "joint4.stiffness", 5e4),
    (102, "payload@robot:mass=2", "robot.payload.mass", 2.0),
    (112, "payload@robot:mass=1", "robot.payload.mass", 1.0),
    (103, "torque_delay@robot:seconds=1e-3", "robot.torque_delay.seconds", 1e-3),
    (113, "torque_delay@robot:seconds=3e-4", "robot.torque_delay.seconds", 3e-4),
    (104, "torque_constant_error@joint2:share=0.05", "joint2.torque_constant_error.share", 0.05),
)


def kinds_rows(robot: Robot, data: Path, tell: Tell) -> dict[str, Any]:
    """The joint estimate of the recordings made elsewhere.

    Args:
        robot: the TX90L.
        data: folder of the sets.
        tell: takes each line.
    """
    shaken = {name: read_shaken(data / "frequency" / f"frequency_{name}", robot) for name in ("P1", "P3")}
    poses, verification = (read_poses(data / f"poses_{name}", robot) for name in ("calibration", "verification"))
    alone, found = calibrate_poses(robot, [poses]), {}
    tell("| poses and frequency responses made elsewhere | wanted | 90 % [mm] | largest [mm] | s |")
    tell("| --- | --- | --- | --- | --- |")
    for label, names in (("P1 and P3", ("P1", "P3")), ("P1 alone, a poor set", ("P1",))):
        began = time.perf_counter()
        both = calibrate_kinds(robot, [shaken[name] for name in names], [poses])
        seconds = time.perf_counter() - began
        _row(tell, found, f"one graph, {label}", "0.055, 0.11", _tip(both.robot, verification), seconds)
        held = calibrate_frequency(robot, [shaken[name] for name in names])
        two = calibrate_poses(_stiffnesses_held(held.robot, robot), [poses])
        _row(tell, found, f"two stages, {label}", "-", _tip(two.robot, verification), None)
        names_of = [f"joint{j}.{part}" for j in (1, 2, 3) for part in (STIFFNESS, *BEARING)]
        grown = {n: _sigma(both, n) / min(_sigma(held, n), _sigma(alone, n)) for n in names_of}
        worst = max(grown, key=lambda n: grown[n])
        tell(f"| {label}: largest sigma over that of the better kind alone | 1 | {grown[worst]:.3f} ({worst}) | | |")
        found[f"sigmas, {label}"] = grown
    _row(tell, found, "poses alone", "-", _tip(alone.robot, verification), None)
    tell("")
    return {"kinds": found}


def search_rows(robot: Robot, tell: Tell) -> dict[str, Any]:
    """What is found in arms that MuJoCo made: 40 poses and two poses that are shaken, two realisations each."""
    tell("| simulated, 40 poses and 2 shaken | added | size over the truth, in sigmas | s |\n| --- | --- | --- | --- |")
    rows, false, first, held = [], 0, 0, 0
    for seed in CLEAN:
        added, _, seconds = _searched(robot, seed, ())
        false += bool(added)
        tell(f"| nothing (seed {seed}) | {', '.join(added) or 'nothing'} | | {seconds:.0f} |")
        rows.append({"seed": seed, "added": added, "seconds": seconds})
    for seed, fault, name, true in FAULTS:
        added, last, seconds = _searched(robot, seed, (fault,))
        first += added[:1] == [fault.partition(":")[0]]
        p = last.parameters.get(name)
        away = float("nan") if p is None else (p.value - true) / (p.sigma or float("nan"))
        held += abs(away) < 3.0
        said = "not there" if p is None else f"{p.value:.4g} of {true:.4g}, {away:+.1f}"
        tell(f"| {fault} (seed {seed}) | {', '.join(added) or 'nothing'} | {said} | {seconds:.0f} |")
        rows.append({"seed": seed, "hidden": fault, "added": added, "away": away, "seconds": seconds})
    tell(f"\nclean arms with a false effect: {false} of {len(CLEAN)}; faults named first: {first} of {len(FAULTS)}; ")
    tell(f"sizes within 3 sigma: {held} of {len(FAULTS)}\n")
    return {"search": rows, "false": false, "first": first, "held": held}


def _searched(robot: Robot, seed: int, effects: tuple[str, ...]) -> tuple[list[str], Robot, float]:
    conditions = PoseConditions(effects=effects)
    poses, _ = simulate_poses(robot, 40, seed, conditions)
    made, _, _ = simulate_frequency(robot, seed, conditions, Shaking())
    with TemporaryDirectory() as folder:
        each = [(r.name, r.signals, r.command) for r in made]
        bags = write_shaken(Path(folder) / "shaken", robot, each, made[0].excitation, "")
        recordings = list(_read(bags, robot))
    began = time.perf_counter()
    found = discover_arm(robot, [poses], recordings=recordings)
    seconds = time.perf_counter() - began
    return [s.added.hypothesis.label for s in found.steps if s.added is not None], found.robot, seconds


def _read(bags: Any, robot: Robot) -> Iterator[Any]:
    for bag in bags:
        yield read_shaken(bag, robot)


def _stiffnesses_held(found: Robot, robot: Robot) -> Robot:
    """The robot with stiffnesses that another stage found, which this one may not change."""
    ends = (f".{STIFFNESS}", *BEARING)
    parameters = {
        n: replace(p, value=found.parameters[n].value, fixed=True) if n.endswith(ends) else p
        for n, p in robot.parameters.items()
    }
    return replace(robot, parameters=parameters)


def _row(tell: Tell, found: dict[str, Any], label: str, wanted: str, mm: dict[str, float], s: float | None) -> None:
    seconds = "" if s is None else f"{s:.0f}"
    tell(f"| {label} | {wanted} | {mm['p90_mm']:.4f} | {mm['max_mm']:.3f} | {seconds} |")
    found[label] = mm


def _sigma(result: Any, name: str) -> float:
    """Of a logarithm."""
    p = result.robot.parameters[name]
    return float((p.sigma or np.inf) / p.value)


def _tip(robot: Robot, poses: Any) -> dict[str, float]:
    return tip_errors(placed(robot, [poses])[1][0]).to_json()
