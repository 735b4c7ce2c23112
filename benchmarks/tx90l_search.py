# SPDX-License-Identifier: BSD-3-Clause
"""What `discover` finds in TX90Ls that MuJoCo made, with 40 poses and two poses that are shaken in one graph.

A fault is an effect that the model lacks, a value of the model far from where it begins, or a pose that was measured
wrong. The first is found where it, or what its own ranking calls the same here, is added first; the others where
nothing is added. An interrupted run goes on where it stopped.
"""

from __future__ import annotations

import hashlib
import pickle
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from kept_rows import keep, known_rows

import jointscope.graphs
from jointscope.graphs.joint_kinds.discover_arm import ArmDiscovery, discover_arm
from jointscope.robots.errors import JointscopeError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.tools.bags.at_poses.read_shaken import read_shaken
from jointscope.tools.bags.at_poses.write_shaken import write_shaken
from jointscope.tools.simulator.frequency_simulation import Shaking, simulate_frequency
from jointscope.tools.simulator.pose_simulation import PoseConditions, simulate_poses

Tell = Callable[[str], None]
POSES = 40
OUTLIER = 17  # number of the pose that is measured wrong


@dataclass(frozen=True)
class Case:
    """An arm.

    Attributes:
        seed: of the arm.
        name: what was done to it.
        effects: that its model lacks, as the simulator takes them.
        sizes: true values that must be found, by name of the parameter.
        values: of the arm itself, where they are not drawn.
        outlier: by how much a target is measured wrong [m].
    """

    seed: int
    name: str
    effects: tuple[str, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    outlier: float = 0.0


def _effect(seed: int, text: str, **sizes: float) -> Case:
    """An effect that the model lacks; underscores of the names of parameters stand for dots."""
    return Case(seed, text, (text,), {name.replace("__", "."): size for name, size in sizes.items()})


def _value(seed: int, **values: float) -> Case:
    named = {name.replace("__", "."): value for name, value in values.items()}
    return Case(seed, ", ".join(f"{name} = {value:g}" for name, value in named.items()), (), named, named)


def _wave(amplitude: float, phase: float) -> tuple[float, float]:
    return amplitude * float(np.cos(phase)), -amplitude * float(np.sin(phase))


def _ripple(seed: int, joint: int, amplitude: float, order: int) -> Case:
    cos, sin = _wave(amplitude, 0.3)
    text = f"gear_ripple@joint{joint}:amplitude={amplitude:g},order={order},phase=0.3"
    name = f"joint{joint}.gear_ripple"
    return Case(seed, text, (text,), {f"{name}.cos": cos, f"{name}.sin": sin})


CLEAN = tuple(Case(seed, f"nothing (seed {seed})") for seed in range(100, 110))
FAULTS = (
    _value(200, joint2__bearing__stiffness_x=2.6e5, joint2__bearing__stiffness_y=2.3e5),
    _value(201, joint2__bearing__stiffness_x=4e5, joint2__bearing__stiffness_y=3.5e5),
    _value(202, joint3__stiffness=3.8e4),
    _value(203, joint2__stiffness=1.2e5),
    _effect(204, "spring_cubic@joint3:stiffness=1e11", joint3__spring_cubic__stiffness=1e11),
    _effect(205, "spring_cubic@joint2:stiffness=4e10", joint2__spring_cubic__stiffness=4e10),
    _value(206, joint3__backlash=-2e-4),
    _effect(207, "backlash@joint5:half_gap=3e-4", joint5__backlash=-3e-4),
    _effect(208, "payload@robot:mass=2", robot__payload__mass=2.0),
    _effect(209, "payload@robot:mass=1", robot__payload__mass=1.0),
    _value(210, joint4__offset=5e-3),
    _value(211, joint3__offset=-8e-3),
    _value(212, joint3__lx=2e-3),
    _value(213, joint4__lx=-3e-3),
    _effect(
        214,
        "encoder_eccentricity@joint2:cos=2e-4,sin=0",
        joint2__encoder_eccentricity__cos=2e-4,
        joint2__encoder_eccentricity__sin=0.0,
    ),
    _effect(
        215,
        "encoder_eccentricity@joint4:cos=4e-4,sin=1e-4",
        joint4__encoder_eccentricity__cos=4e-4,
        joint4__encoder_eccentricity__sin=1e-4,
    ),
    _effect(216, "tracker_drift@robot:x=2e-4,z=0", tracker__tracker_drift__x=2e-4),
    _effect(217, "tracker_drift@robot:x=0,z=3e-4", tracker__tracker_drift__z=3e-4),
    _effect(218, "torque_constant_error@joint2:share=0.05", joint2__torque_constant_error__share=0.05),
    _effect(219, "torque_constant_error@joint3:share=0.02", joint3__torque_constant_error__share=0.02),
    _effect(220, "torque_delay@robot:seconds=1e-3", robot__torque_delay__seconds=1e-3),
    _effect(221, "torque_delay@robot:seconds=3e-4", robot__torque_delay__seconds=3e-4),
    _ripple(222, 2, 8e-5, 96),
    _ripple(223, 3, 1.6e-4, 60),
    Case(224, f"pose {OUTLIER} measured 1 mm wrong", outlier=1e-3),
    Case(225, f"pose {OUTLIER} measured 0.4 mm wrong", outlier=4e-4),
    _value(226, joint2__coulomb_torque=26.0),
    _effect(227, "motor_stribeck@joint2:torque=6", joint2__motor_stribeck__torque=6.0),
    _effect(228, "load_dependent_friction@joint2:coefficient=0.05", joint2__load_dependent_friction__coefficient=0.05),
    _effect(229, "joint_elasticity@joint5:compliance=4e-5", joint5__stiffness=2.5e4),
    _effect(230, "joint_elasticity@joint4:compliance=2e-5", joint4__stiffness=5e4),
)


def search_rows(robot: Robot, folder: Path, tell: Tell, measure: bool = True) -> dict[str, Any]:
    """What is found in each arm.

    Args:
        robot: the TX90L.
        folder: of recordings, and of the rows that earlier runs of this code measured.
        tell: takes each line.
        measure: whether arms that are missing are measured; else the table is of what is there.
    """
    results, now, known = rows_in(folder, "search")
    tell("| simulated, 40 poses and 2 shaken | added | size over the truth, in sigmas | s |\n| --- | --- | --- | --- |")
    rows = []
    for case in (*CLEAN, *FAULTS):
        if case.name not in known and not measure:
            continue
        if case.name not in known:
            known[case.name] = row_of(robot, case, folder)
            keep(results, now, known[case.name])
        row = known[case.name]
        added = ", ".join(row["added"]) or "nothing"
        added = f"refused: {row['refused'].partition(';')[0]}" if "refused" in row else added
        tell(f"| {case.name} | {added} | {_sizes_said(row)} | {row['seconds']:.0f} |")
        rows.append(row)
    named = {case.name for case in CLEAN}
    clean, faults = [r for r in rows if r["name"] in named], [r for r in rows if r["name"] not in named]
    if len(rows) < len(CLEAN) + len(FAULTS):
        tell(f"\nnot measured yet: {len(CLEAN) - len(clean)} clean arms, {len(FAULTS) - len(faults)} faults")
    count = {
        "false": sum(bool(row["added"]) for row in clean),
        "first": sum(row["first"] for row in faults),
        "alone": sum(row["first"] and len(row["added"]) <= bool(row["effects"]) for row in faults),
        "held": sum(row["held"] for row in faults),
    }
    tell(f"\nclean arms with a false effect: {count['false']} of {len(clean)}")
    said = f"{count['first']} of {len(faults)}, with nothing beside: {count['alone']}"
    tell(f"faults named first, or by a look-alike: {said}; sizes within 3 sigma: {count['held']}")
    longest = max(rows, key=lambda row: row["seconds"])
    tell(f"longest search: {longest['seconds']:.0f} s ({longest['name']})\n")
    return {"search": rows, **count}


def row_of(robot: Robot, case: Case, folder: Path) -> dict[str, Any]:
    """Simulates and searches one arm; recordings that are refused are no find."""
    poses, recordings = kept(robot, case, folder)
    began = time.perf_counter()
    try:
        row = judged(case, discover_arm(robot, [poses], recordings=recordings))
    except JointscopeError as err:
        row = dict.fromkeys(("alike", "first", "held"), False) | {"name": case.name, "effects": list(case.effects)}
        row |= {"added": [], "look_alikes": [], "sizes": {}, "refused": str(err).partition(": ")[2]}
    return row | {"seconds": time.perf_counter() - began}


def kept(robot: Robot, case: Case, folder: Path) -> tuple[Poses, list[Any]]:
    """The recordings of an arm, simulated where the folder does not have them from the same simulator."""
    told = hashlib.sha256(f"{case} {code('tools/simulator', 'robots/ready/tx90l')}".encode()).hexdigest()[:12]
    path = folder / f"{case.seed}-{told}.pickle"
    if not path.is_file():
        found = recorded(robot, case)
        path.with_suffix(".part").write_bytes(pickle.dumps(found))
        path.with_suffix(".part").rename(path)
    content: tuple[Poses, list[Any]] = pickle.loads(path.read_bytes())
    return content


def recorded(robot: Robot, case: Case) -> tuple[Poses, list[Any]]:
    """The recordings of an arm."""
    conditions = PoseConditions(effects=case.effects, values=case.values)
    poses, _ = simulate_poses(robot, POSES, case.seed, conditions)
    if case.outlier:
        assert poses.target is not None
        target = poses.target.copy()
        target[OUTLIER] += case.outlier * np.array([0.6, 0.0, 0.8])
        poses = replace(poses, target=target)
    made, _, _ = simulate_frequency(robot, case.seed, conditions, Shaking())
    with TemporaryDirectory() as folder:
        each = [(r.name, r.signals, r.command) for r in made]
        bags = write_shaken(Path(folder) / "shaken", robot, each, made[0].excitation, "")
        return poses, list(_read(bags, robot))


def judged(case: Case, found: ArmDiscovery) -> dict[str, Any]:
    """What was found beside what is true."""
    added = [step.added for step in found.steps if step.added is not None]
    labels = [candidate.hypothesis.label for candidate in added]
    wanted = [text.partition(":")[0] for text in case.effects]
    alike = bool(added) and any(label in wanted for label in added[0].look_alikes)
    first = labels[:1] == wanted[:1] or alike
    if case.outlier:
        last = found.steps[-1].calibrated.poses
        out = [] if last is None else [each.name for each in last.left_out]
        first = first and out == [str(OUTLIER)]
    sizes = {name: _away(found.robot, name, true) for name, true in case.sizes.items()}
    held = all(away is None or abs(away["sigmas"]) < 3.0 for away in sizes.values())
    held = held and (alike or all(away is not None for away in sizes.values()))
    return {
        "name": case.name,
        "effects": list(case.effects),
        "added": labels,
        "alike": alike,
        "first": first,
        "held": held,
        "sizes": sizes,
        "look_alikes": [list(candidate.look_alikes) for candidate in added],
    }


def _away(robot: Robot, name: str, true: float) -> dict[str, float] | None:
    p = robot.parameters.get(name)
    if p is None:
        return None
    return {"value": p.value, "true": true, "sigmas": (p.value - true) / (p.sigma or float("nan"))}


def _sizes_said(row: Mapping[str, Any]) -> str:
    known = [away for away in row["sizes"].values() if away is not None]
    each = [f"{a['value']:.4g} of {a['true']:.4g}, {a['sigmas']:+.1f}" for a in known]
    return "; ".join([*each, *["not there"] * (len(row["sizes"]) - len(known))])


def _read(bags: Any, robot: Robot) -> Iterator[Any]:
    for bag in bags:
        yield read_shaken(bag, robot)


def rows_in(folder: Path, part: str) -> tuple[Path, str, dict[str, Any]]:
    """The file with the rows of a part, the code that they are of, and those that are there, by name."""
    folder.mkdir(parents=True, exist_ok=True)
    results, now = folder / f"{part}.jsonl", code("robots", "factors", "graphs", "tools/bags", "tools/simulator")
    return results, now, known_rows(results, now)


def code(*parts: str) -> str:
    """Changes with parts of the package, so that nothing stale is used."""
    package = Path(jointscope.graphs.__file__).resolve().parents[1]
    files = [path for part in parts for path in (package / part).rglob("*") if path.suffix in (".py", ".yaml", ".urdf")]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()[:12]
