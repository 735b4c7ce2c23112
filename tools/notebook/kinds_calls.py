# SPDX-License-Identifier: BSD-3-Clause
"""`diagnose` and `discover` with rests, poses or frequency responses beside motion, or with two of these without it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from jointscope.graphs.across_kinds.diagnose_kinds import diagnose_kinds
from jointscope.graphs.across_kinds.discover_kinds import discover_kinds
from jointscope.graphs.across_kinds.kinds_recordings import KindsRecordings
from jointscope.graphs.solving.batch_solver import Progress
from jointscope.robots.errors import RecordingError
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.recordings.signals import Excitation, Signals
from jointscope.robots.rests.rests import Rests
from jointscope.tools.bags.at_poses.read_poses import read_poses
from jointscope.tools.bags.at_poses.read_rests import read_rests
from jointscope.tools.bags.at_poses.read_shaken import read_shaken
from jointscope.tools.notebook.given import AnyRecording, AnyRobot, AnyStretches, robot_of, to_learn_from
from jointscope.tools.notebook.kinds_results import KindsDiagnosed, KindsDiscovered
from jointscope.tools.verb_parts.searches.kinds_search import must_have_sections

AnyRests = Sequence[str | Path | Rests]
AnyPoses = Sequence[str | Path | Poses]
AnyShaken = Sequence[str | Path | tuple[Signals, Excitation]]
T = TypeVar("T")


@dataclass(frozen=True)
class Still:
    """Recordings beside motion as a caller gives them: paths, or what readers make of these.

    Attributes:
        rests: bags in which the robot stands.
        poses: tables or bags of the arm at rest with a measured target.
        frequency: bags in which the arm is shaken.
        holdout: those that are held out; none of these itself.
    """

    rests: AnyRests = ()
    poses: AnyPoses = ()
    frequency: AnyShaken = ()
    holdout: Still | None = field(default=None)

    @property
    def some(self) -> bool:
        """Whether there is any, held out ones included."""
        return bool(self.rests or self.poses or self.frequency) or (self.holdout is not None and self.holdout.some)

    def read(self, robot: Robot) -> dict[str, tuple[Any, ...]]:
        """The recordings, as `KindsRecordings` has them."""
        return {
            "rests": _each(self.rests, Rests, lambda path: read_rests(path, robot), "rests"),
            "poses": _each(self.poses, Poses, lambda path: read_poses(Path(path), robot), "poses"),
            "shaken": _each(self.frequency, tuple, lambda path: read_shaken(Path(path), robot), "frequency"),
        }


def diagnosed(
    robot: AnyRobot,
    recordings: AnyRecording | Sequence[AnyRecording],
    holdout: AnyRecording | None,
    still: Still,
    leave_out: AnyStretches,
    progress: Progress | None,
    **options: Any,
) -> KindsDiagnosed:
    """What is missing by all kinds; arguments as of `diagnose`.

    Raises:
        JointscopeError: as of `diagnose`, or kinds that have one graph.
    """
    model, given, held = _read(robot, recordings, holdout, still, leave_out)
    return KindsDiagnosed.of(diagnose_kinds(model, given, held, progress, **options), given=given, held=held)


def discovered(
    robot: AnyRobot,
    recordings: AnyRecording | Sequence[AnyRecording],
    holdout: AnyRecording | None,
    still: Still,
    leave_out: AnyStretches,
    progress: Progress | None,
    **options: Any,
) -> KindsDiscovered:
    """One model grown by all kinds; arguments as of `discover`.

    Raises:
        JointscopeError: as of `discover`, or kinds that have one graph.
    """
    model, given, held = _read(robot, recordings, holdout, still, leave_out)
    return KindsDiscovered.of(discover_kinds(model, given, held, progress, **options))


def _read(
    robot: AnyRobot,
    recordings: AnyRecording | Sequence[AnyRecording],
    holdout: AnyRecording | None,
    still: Still,
    leave_out: AnyStretches,
) -> tuple[Robot, KindsRecordings, KindsRecordings]:
    """The robot, what is learnt from, and what is held out."""
    model = robot_of(robot)
    moving = not isinstance(recordings, Sequence) or len(recordings) > 0
    if moving + bool(still.rests) + bool(still.poses or still.frequency) < 2:
        raise RecordingError(
            "expected two or all of motion, rests, and poses or frequency responses; rests alone are for "
            "jointscope.graphs.rest_search.discover_rests, poses and responses for "
            "jointscope.graphs.joint_kinds.discover_arm"
        )
    must_have_sections(model, moving or bool(still.rests), bool(still.poses), bool(still.frequency))
    motion, held = list[Recording](), None
    if moving:
        model, motion, held = to_learn_from(model, recordings, holdout, leave_out)
    elif holdout is not None or leave_out:
        raise RecordingError("holdout and leave_out are of motion, of which no recording is given; leave them out")
    given = KindsRecordings(tuple(motion), **still.read(model))
    apart = KindsRecordings(() if held is None else (held,), **(still.holdout or Still()).read(model))
    return model, given, apart


def _each(given: Sequence[Any], kind: type[T], read: Callable[[str | Path], T], name: str) -> tuple[T, ...]:
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise RecordingError(f"{name}: expected a list of paths or recordings, got {type(given).__name__}")
    found = []
    for one in given:
        if not isinstance(one, str | Path | kind):
            raise RecordingError(f"{name}: expected a path or {kind.__name__}, got {type(one).__name__}")
        found.append(read(one) if isinstance(one, str | Path) else one)
    return tuple(found)
