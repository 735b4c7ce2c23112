# SPDX-License-Identifier: BSD-3-Clause
"""What `discover` keeps beside its output: a robot file per step and a state, so that a second run continues.

OUT.yaml comes with OUT.step0.yaml, OUT.step1.yaml, ... and OUT.discovery.json, which holds hashes of everything that
went in: steps of other bags, or of a base robot that was edited since, are never taken for steps of this run.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from jointscope.graphs.discovery.discovery_result import DiscoveryStep, SavedStep
from jointscope.robots.errors import JointscopeError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.writing.origin import step_provenance
from jointscope.tools.writing.whole_file import whole_file, write_json

FORMAT = 1
ANEW = "start anew with --restart"
Hashes = Mapping[str, Any]


def state_file(output: Path) -> Path:
    """Where the state of a discovery lies."""
    return output.with_name(f"{output.stem}.discovery.json")


def step_file(output: Path, index: int) -> Path:
    """Where the robot of a step lies."""
    return output.with_name(f"{output.stem}.step{index}.yaml")


def hashes_of(
    robot: Robot, recordings: Sequence[Recording], holdout: Recording | None, effects: Sequence[Path]
) -> dict[str, Any]:
    """What a discovery started from, as hashes."""
    everything = [*recordings, *([holdout] if holdout else [])]
    stretches = [[list(stretch) for stretch in recording.left_out] for recording in everything]
    return {
        "robot": _sha256(robot.path, robot.tree.urdf),
        "bags": [recording.sha256 for recording in recordings],
        "holdout": holdout.sha256 if holdout else None,
        "effects": [_sha256(file) for file in effects],
        "left_out": stretches if any(stretches) else None,
    }


class DiscoveryState:
    """Saves every finished step and gives them back to a later run.

    Args:
        output: OUT.yaml.
        hashes: what this run starts from.
        recordings: for training; their names go into the robot files.
        start: name of the base robot's file.
    """

    def __init__(self, output: Path, hashes: Hashes, recordings: Sequence[Recording], start: str):
        self._output, self._hashes, self._recordings, self._start = output, dict(hashes), recordings, start
        self._entries: list[dict[str, Any]] = []

    @property
    def count(self) -> int:
        """Steps that are on disk."""
        return len(self._entries)

    def resume(self) -> tuple[SavedStep, ...]:
        """The steps of an earlier run with the same inputs; none if there was none.

        Raises:
            JointscopeError: the state belongs to other inputs, or a file was damaged or changed.
        """
        file = state_file(self._output)
        if not file.exists():
            return ()
        content = _read(file)
        odd = [name for name, value in self._hashes.items() if content["inputs"].get(name) != value]
        if odd:
            raise JointscopeError(
                f"{file} holds a discovery from other inputs ({', '.join(odd)} differ); give -o another name, or {ANEW}"
            )
        steps = tuple(self._saved(entry) for entry in content["steps"])
        self._entries = content["steps"]
        return steps

    def save(self, index: int, step: DiscoveryStep) -> str:
        """Writes the step's robot file and then the state; returns the path of the robot file."""
        place = step_file(self._output, index)
        provenance = step_provenance(step, index, self._start, self._recordings)
        text = robot_text(step.robot, place.parent, provenance)
        entry = {
            "added": step.added,
            "removed": step.removed,
            "robot_file": place.name,
            "sha256": hashlib.sha256(text.encode()).hexdigest(),
            "train_error": step.train_error,
            "heldout_error": step.heldout_error,
            "floor": step.floor,
            "paragraph": step.paragraph,
        }
        entries = [*self._entries[:index], entry]
        with ExitStack() as stack:  # the last one in is moved first: a state never names a file that is not there
            state = stack.enter_context(whole_file(state_file(self._output)))
            stack.enter_context(whole_file(place)).write_text(text, encoding="utf-8")
            write_json(state, {"format": FORMAT, "inputs": self._hashes, "steps": entries})
        self._entries = entries
        return str(place)

    def _saved(self, entry: Mapping[str, Any]) -> SavedStep:
        place = self._output.with_name(entry["robot_file"])
        if not place.is_file() or _sha256(place) != entry["sha256"]:
            raise JointscopeError(f"{place} is missing or was changed since it was saved; put it back, or {ANEW}")
        errors = (entry[name] for name in ("train_error", "heldout_error", "floor"))
        train, heldout, floor = (float("nan") if value is None else float(value) for value in errors)
        return SavedStep(
            entry["added"],
            entry["removed"],
            load_robot(place),
            str(place),
            train,
            heldout,
            floor,
            entry["paragraph"],
        )


def _read(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        names = {"added", "removed", "robot_file", "sha256", "train_error", "heldout_error", "floor", "paragraph"}
        if content["format"] == FORMAT and isinstance(content["inputs"], dict):
            if all(names <= set(step) for step in content["steps"]):
                return dict(content)
    except (OSError, ValueError, KeyError, TypeError):
        pass
    raise JointscopeError(f"{file} is not the state of a discovery that this version can continue; {ANEW}")


def _sha256(*files: Path) -> str:
    digest = hashlib.sha256()
    for file in files:
        try:
            digest.update(file.read_bytes())
        except OSError as err:
            raise JointscopeError(f"cannot read {file}: {err.strerror or err}") from err
    return digest.hexdigest()
