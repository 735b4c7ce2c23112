# SPDX-License-Identifier: BSD-3-Clause
"""Where the tracker stands and where targets are on the tool, from the poses themselves, where nobody says it.

The tracker is placed by all targets whose place on the tool is known, then come the targets whose place is not, and
then how targets are oriented on the tool.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointscope.factors.calibration import DYNAMICS, Calibration
from jointscope.graphs.poses.pose_set import PoseSet
from jointscope.graphs.poses.sagging_arm import SaggingPoint, in_tracker
from jointscope.graphs.poses.seen_targets import Mount, mounts, places_on
from jointscope.robots.bodies.misplaced_joints import ANGLES, LENGTHS
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.error_parameters import TOOL
from jointscope.robots.geometry.rotations import mean_rotation
from jointscope.robots.geometry.tracker_fit import base_from_tracker, tracker_and_shift
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses, Sighting

Array = NDArray[np.float64]
TOOL_KNOWN = 5e-3  # [m] the place of a target that is known less well is looked for with that of the tracker
FEWEST = 4  # sightings of a target that tell its place and that of the tracker
ANY_TURN = 0.1  # [rad] prior sigma of an orientation on the tool that the poses themselves have told


def tracker_and_target(problem: PoseSet, measured: Array) -> tuple[Array, Array, float]:
    """Tracker and first target of a set of poses.

    Returns:
        Base from tracker, shape (4, 4), shift of the target in the axes of its link, shape (3,), what is left [m].
    """
    values = problem.values(Calibration.of(problem.robot).only([DYNAMICS]))
    point = problem.arm.at(problem.q, np.zeros_like(problem.q), values)
    turns = np.stack([point.by_value[f"{TOOL}.{part}"] for part in LENGTHS], axis=2)
    return tracker_and_shift(point.target, turns, measured, np.zeros(3))


def placed(robot: Robot, sessions: Sequence[Poses]) -> tuple[Robot, list[PoseSet]]:
    """The sessions with the tracker where it stands, and the robot with its targets where they are on the tool.

    Where nothing says it, that is found from the poses.
    """
    robot, problems = _with_trackers(robot, sessions)
    for problem in problems:
        _ = problem.arm, problem.targets  # say what is missing
    robot = _with_other_targets(robot, problems)
    robot = _with_turns(robot, [problem.of_robot(robot) for problem in problems])
    return robot, [problem.of_robot(robot) for problem in problems]


def _with_trackers(robot: Robot, sessions: Sequence[Poses]) -> tuple[Robot, list[PoseSet]]:
    setup = robot.poses
    known = setup is None or setup.tracker is not None or all(poses.contacts for poses in sessions)
    tracker = np.eye(4) if setup is None or setup.tracker is None else setup.tracker
    problems = [PoseSet(robot, poses, tracker) for poses in sessions]
    if setup is None or known:
        return robot, problems
    first = problems[0].of_first
    if setup.tool_sigma > TOOL_KNOWN and first.poses.target is not None and len(first.poses) >= FEWEST:
        shift = tracker_and_target(first, first.poses.target)[1]
        values = {f"{TOOL}.{part}": float(v) for part, v in zip(LENGTHS, shift, strict=True)}
        robot = robot.with_values(values if all(abs(robot.parameters[n].value) < TOOL_KNOWN for n in values) else {})
        problems = [problem.of_robot(robot) for problem in problems]
    found = [replace(problem, tracker=base_from_tracker(*_known_points(problem))[0]) for problem in problems]
    robot = replace(robot, poses=replace(setup, tracker=found[0].tracker))
    own = [replace(problem, own_tracker=not problem.poses.contacts) for problem in found]
    return robot, [problem.of_robot(robot) for problem in own]


def _known_points(problem: PoseSet) -> tuple[Array, Array]:
    """Places of targets that are known on the tool: predicted in the base frame, and measured, shape (s, 3) each."""
    values, robot = problem.values(Calibration.of(problem.robot)), problem.robot
    point = problem.arm.at(problem.q, np.zeros_like(problem.q), values, True)
    first, *others = mounts(robot).items()
    told = {first[0], *(name for name, mount in others if not is_open(robot, mount.owner))}
    predicted = {name: place for name, place in places_on(robot, point, values).items() if name in told}
    seen = [sighting for sighting in problem.targets.sightings if sighting.name in predicted]
    known = [(predicted[s.name], s.place, np.isfinite(s.place[:, 0])) for s in seen]
    if not known:
        raise RecordingError(
            f"{problem.poses.path}: no target is seen whose place on the tool is known, so that nothing tells where "
            f"the tracker stands; record {first[0]}, or give one of the others its `at` in {robot.path.name}"
        )
    return np.concatenate([p[there] for p, _, there in known]), np.concatenate([x[there] for _, x, there in known])


def is_open(robot: Robot, owner: str) -> bool:
    """Whether the place of a further target on the tool is not known."""
    parameters = [robot.parameters[f"{owner}.{part}"] for part in LENGTHS]
    return all(not p.fixed and p.prior_sigma > TOOL_KNOWN and abs(p.value) < TOOL_KNOWN for p in parameters)


def _with_other_targets(robot: Robot, problems: Sequence[PoseSet]) -> Robot:
    """Places of further targets on the tool, where they are not known: the middle of what the poses say."""
    (_, first), *others = mounts(robot).items()
    values: dict[str, float] = {}
    for name, mount in others:
        if not is_open(robot, mount.owner):
            continue
        shifts = [np.zeros((0, 3))]
        for problem, sighting in _sightings(problems, name):
            tool, known = tool_seen(problem)
            link, begin = mount.on(tool), mount.away(first, known) - mount.place(known)
            away = np.einsum("mji,mj->mi", link.turn, sighting.place - link.target)
            shifts.append((away - begin - mount.at) @ mount.R_link)
        seen = np.concatenate(shifts)
        seen = seen[np.isfinite(seen[:, 0])]
        if len(seen):
            values |= {f"{name}.{part}": float(v) for part, v in zip(LENGTHS, np.median(seen, axis=0), strict=True)}
    return robot.with_values(values)


def _with_turns(robot: Robot, problems: Sequence[PoseSet]) -> Robot:
    """How targets are oriented on the tool, where that is not known: the mean of what the poses say."""
    setup, parameters = robot.poses, dict(robot.parameters)
    if setup is None:
        return robot
    turns: dict[str, Array] = {}
    for name, mount in mounts(robot).items():
        seen = on_tool(problems, name, mount)
        target = next(target for target in setup.targets if target.name == name)
        angles = [f"{mount.owner}.{part}" for part in ANGLES]
        if len(seen) and target.turn is None:
            turns[name] = mean_rotation(seen)
            parameters |= {n: replace(parameters[n], prior_sigma=ANY_TURN) for n in angles if not parameters[n].fixed}
        elif not len(seen) and mount.owner != TOOL:
            parameters |= {n: replace(parameters[n], fixed=True) for n in angles}
    others = tuple(replace(target, turn=turns.get(target.name, target.turn)) for target in setup.others)
    setup = replace(setup, turn=turns.get(setup.link, setup.turn), others=others)
    return replace(robot, poses=setup, parameters=parameters)


def on_tool(problems: Sequence[PoseSet], name: str, mount: Mount) -> Array:
    """Measured orientations of a target in the axes of its link as the arm has them, shape (s, 3, 3)."""
    found = [np.zeros((0, 3, 3))]
    for problem, sighting in _sightings(problems, name):
        if sighting.turn is not None:
            seen = np.isfinite(sighting.turn[:, 0, 0])
            R_tracker_link = mount.on(tool_seen(problem)[0]).turn @ mount.R_link
            found.append((np.swapaxes(R_tracker_link, 1, 2) @ sighting.turn)[seen])
    return np.concatenate(found)


def tool_seen(problem: PoseSet) -> tuple[SaggingPoint, dict[str, float]]:
    """The tool and other links with targets in the axes of the tracker at the robot's values, and these."""
    values = problem.values(Calibration.of(problem.robot))
    point = problem.arm.at(problem.q, np.zeros_like(problem.q), values, True)
    return in_tracker(point, problem.tracker, values, problem.poses.shares), values


def predicted_places(problem: PoseSet) -> dict[str, Array]:
    """Places of all targets in the axes of the tracker at the robot's values, shape (m, 3) each."""
    return places_on(problem.robot, *tool_seen(problem))


def tracker_by(problem: PoseSet, some: Sequence[Sighting]) -> tuple[Array, float]:
    """Base from tracker, shape (4, 4), by some targets alone, and how well it fits [m]."""
    seen, places = [np.isfinite(s.place[:, 0]) for s in some], predicted_places(problem)
    predicted = [places[s.name][there] for s, there in zip(some, seen, strict=True)]
    measured = np.concatenate([s.place[there] for s, there in zip(some, seen, strict=True)])
    T, left, _ = base_from_tracker(np.concatenate(predicted), measured)
    return np.asarray(problem.tracker @ T), left


def _sightings(problems: Sequence[PoseSet], name: str) -> list[tuple[PoseSet, Sighting]]:
    return [(problem, s) for problem in problems for s in problem.targets.sightings if s.name == name]
