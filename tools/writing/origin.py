# SPDX-License-Identifier: BSD-3-Clause
"""Where results come from, as robot files and JSON have it: version, date, start model, recordings and their hashes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import jointscope
from jointscope.robots.recordings.recording import Recording

KINDS = ("bags", "rests", "poses", "frequency", "locked_springs")
"""Keys under which recordings stand."""
COUNTED = {"rests": "rests", "poses": "poses", "locked_springs": "readings"}
"""Kinds whose samples are counted, and where a set of each has its recording."""


def provenance(result: Any) -> dict[str, Any]:
    """Where the numbers of a calibrated robot file come from: version, date, start model, bags with hashes."""
    return {
        **origin(result.start.path.name, [bag.recording for bag in result.bags]),
        **other_kinds(result),
        "samples": int(result.samples),
        "cost": float(result.cost),
    }


def other_kinds(result: Any) -> dict[str, Any]:
    """Rests, poses, frequency responses and locked springs that a calibration used beside motion."""
    every = {k: [counted(getattr(p, at)) for p, *_ in result.sets if p.kind == k] for k, at in COUNTED.items()}
    found: dict[str, Any] = {kind: each for kind, each in every.items() if each}
    shaken = [one.pose for p, *_ in result.sets if p.kind == "frequency" for one in p.problems]
    return found | ({"frequency": [{"path": p.path, "sha256": p.sha256} for p in shaken]} if shaken else {})


def counted(recording: Any) -> dict[str, Any]:
    """A recording without motion, and how many rests, poses or instants of it count."""
    return {"path": recording.path, "sha256": recording.sha256, "count": len(recording)}


def step_provenance(step: Any, index: int, start: str, recordings: Sequence[Recording]) -> dict[str, Any]:
    """Where a step of a discovery comes from: the same, and what was changed."""
    errors = {"train_error": step.train_error, "heldout_error": step.heldout_error, "floor": step.floor}
    return {
        **origin(start, recordings),
        "discovery_step": index,
        **{name: label for name, label in (("added", step.added), ("removed", step.removed)) if label},
        **{name: float(f"{value:.6g}") for name, value in errors.items() if math.isfinite(value)},
    }


def origin(start: str, recordings: Sequence[Recording]) -> dict[str, Any]:
    """Version, date, name of the start model's file, and bags with hashes."""
    return made_from(start) | {
        "bags": [
            {"path": recording.path, "sha256": recording.sha256, "seconds": round(recording.duration, 3)}
            | ({"left_out": [list(stretch) for stretch in recording.left_out]} if recording.left_out else {})
            for recording in recordings
        ],
    }


def made_from(start: str) -> dict[str, Any]:
    """Version, date, name of the start model's file."""
    return {
        "version": jointscope.__version__,
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "start": start,
    }


def recordings_of(made: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The recordings of a result, each with its kind, path and hash."""
    return [{"kind": kind, **each} for kind in KINDS for each in made.get(kind, ())]
