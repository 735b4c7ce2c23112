# SPDX-License-Identifier: BSD-3-Clause
"""What a regression of each rigid joint alone says of a calibration's recordings.

Without states and without process noise that takes what is missing. Reasons compete: each has what it explains at all
joints on its side and the number of its sizes against it, and only the most plausible one is said. Two reasons for one
thing are one too many, and at one joint alone a heavier link is like a gain that falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from jointscope.graphs.scoring.regression.changed_load import ChangedLoad, changed_load
from jointscope.graphs.scoring.regression.joint_regression import JointRows, joint_rows
from jointscope.graphs.scoring.regression.late_drives import LateDrives, late_drives
from jointscope.graphs.scoring.regression.load_friction import LoadFriction, load_frictions
from jointscope.graphs.scoring.regression.regressed_causes import (
    RegressedCause,
    asked_for,
    confirmed,
    late_commands,
    regressed_causes,
)
from jointscope.graphs.scoring.regression.unsteady_gains import UnsteadyGain, unsteady_gains
from jointscope.graphs.scoring.regression.wrong_links import WrongLink, tilted_base, wrong_link
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording

SURELY = 9.2  # evidence from which late commands are no chance: one recording in ten thousand
COMPARABLE = 0.5  # of the evidence for a reason, from which late commands may be another one beside it


@dataclass(frozen=True)
class Asked:
    """What regression says; of the reasons at most one.

    Attributes:
        causes: effects that regression names, joint by joint, and the calibration asks for, too.
        link: which link weighs something else than the URDF says; None where nothing tells of it.
        changed: when the robot takes up or sets down a load, or is pushed; None where nothing tells of it.
        gains: drives whose constant falls with speed, command or time, which no effect of the catalogue knows.
        load_frictions: joints whose friction grows with the torque they pass on, which no effect of rigid joints knows.
        lag: how torques follow their commands, where that is all that is missing.
        late: whether commands that act later, or earlier, than stamped would explain as much, if roughly.
    """

    causes: tuple[RegressedCause, ...] = ()
    link: WrongLink | None = None
    changed: ChangedLoad | None = None
    gains: tuple[UnsteadyGain, ...] = ()
    load_frictions: tuple[LoadFriction, ...] = ()
    lag: LateDrives | None = None
    late: bool = True

    @property
    def names(self) -> bool:
        """Whether there is a reason."""
        return replace(self, lag=None, late=True) != Asked()


def asked_by_regression(robot: Robot, recordings: Sequence[Recording], test: ScoreTest) -> Asked:
    """A load, a gain, or friction that changes, a link, or effects: what is most plausible over all joints.

    Args:
        robot: calibrated, with noise of encoders as it was before a model that lacks something took a part of it.
        recordings: of the calibration.
        test: of the whole recordings, linearised at their solution with the noise used.
    """
    rows = joint_rows(robot, recordings)
    if rows is None:
        return Asked()
    paths = [recording.path for recording in recordings]
    found = most_plausible(rows, paths, confirmed(regressed_causes(rows), test))
    if found.link and not asked_for({label: {} for label in found.link.label.split()}, test):
        return Asked(late=found.late)
    return found if found.names else replace(found, load_frictions=load_frictions(rows))


def most_plausible(rows: JointRows, paths: Sequence[str], causes: tuple[RegressedCause, ...]) -> Asked:
    """Of effects, a link, gains and a load the reason with the most evidence; nothing where there is none.

    Args:
        rows: of the regression.
        paths: of its recordings.
        causes: effects that may be named.
    """
    tilted, late, lag = tilted_base(rows), late_commands(rows), late_drives(rows)
    late = max(late, lag.evidence if lag else 0.0)
    gains, link, changed = unsteady_gains(rows), wrong_link(rows, tilted), changed_load(rows, paths)
    options = [
        (sum(cause.evidence for cause in causes), Asked(causes=causes)),
        (sum(gain.evidence for gain in gains), Asked(gains=gains)),
        (link.evidence if link else 0.0, Asked(link=link)),
        (changed.evidence if changed else 0.0, Asked(changed=changed)),
        (late, Asked(lag=lag if late > SURELY else None)),
        (tilted, Asked()),
    ]
    worth, best = max(options, key=lambda option: option[0])
    return replace(best, late=late > COMPARABLE * worth)
