# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of several kinds of one robot, for training or held out."""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.graphs.across_kinds.said_by_kinds import MOTION, RESTS
from jointscope.robots.errors import RecordingError
from jointscope.robots.geometry.arm_effects import FREQUENCY, POSES
from jointscope.robots.recordings.poses import Poses
from jointscope.robots.recordings.recording import Recording
from jointscope.robots.recordings.signals import Excitation, Signals
from jointscope.robots.rests.rests import Rests


@dataclass(frozen=True)
class KindsRecordings:
    """Recordings of some kinds; of a kind that is empty there is none.

    Attributes:
        motion: of the robot in motion.
        poses: sessions of poses, as of `calibrate_poses`.
        shaken: as of `calibrate_frequency`.
        rests: of each recording in which it stands.
    """

    motion: tuple[Recording, ...] = ()
    poses: tuple[Poses, ...] = ()
    shaken: tuple[tuple[Signals, Excitation], ...] = ()
    rests: tuple[Rests, ...] = ()

    @property
    def kinds(self) -> tuple[str, ...]:
        """Those of which there is a recording."""
        there = {MOTION: self.motion, POSES: self.poses, FREQUENCY: self.shaken, RESTS: self.rests}
        return tuple(kind for kind, each in there.items() if each)

    def must_be_apart(self, held: KindsRecordings) -> None:
        """Recordings that are held out are of kinds that are learnt from, and none of these.

        Raises:
            RecordingError: one is not.
        """
        alone = next((kind for kind in held.kinds if kind not in self.kinds), None)
        if alone is not None:
            raise RecordingError(f"{alone} are held out, but not learnt from; give both, or leave them out")
        own = self._contents
        for kind, others in held._contents.items():
            for path, sha256 in others:
                twin = next((p for p, content in own[kind] if sha256 and content == sha256), None)
                if twin is not None:
                    raise RecordingError(
                        f"{path} is held out and also learnt from ({twin}); hold out one that the model has not seen"
                    )

    @property
    def _contents(self) -> dict[str, list[tuple[str, str]]]:
        """Paths and hashes by kind; recordings of motion may be parts of one, and are compared where they are read."""
        return {
            POSES: [(poses.path, poses.sha256) for poses in self.poses],
            FREQUENCY: [(signals.path, signals.sha256) for signals, _ in self.shaken],
            RESTS: [(rests.path, rests.sha256) for rests in self.rests],
        }

    @property
    def paths(self) -> list[str]:
        """Of all recordings."""
        still = [path for each in self._contents.values() for path, _ in each]
        return [*(recording.path for recording in self.motion), *still]

    @property
    def of_arm(self) -> tuple[str, ...]:
        """Those of them that share a graph: poses and frequency responses."""
        return tuple(kind for kind in self.kinds if kind in (POSES, FREQUENCY))
