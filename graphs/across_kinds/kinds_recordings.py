# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of several kinds of one robot, for training or held out."""

from __future__ import annotations

from dataclasses import dataclass

from jointscope.graphs.across_kinds.said_by_kinds import MOTION, RESTS
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

    @property
    def of_arm(self) -> tuple[str, ...]:
        """Those of them that share a graph: poses and frequency responses."""
        return tuple(kind for kind in self.kinds if kind in (POSES, FREQUENCY))
