# SPDX-License-Identifier: BSD-3-Clause
"""What a regression of each rigid joint alone says of a calibration's recordings.

Joint by joint, without states and without process noise that takes what is missing. A cause that explains less than
another one at the same joint is not said: two reasons for one thing are one too many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from jointscope.graphs.scoring.regression.changed_load import ChangedLoad, changed_load
from jointscope.graphs.scoring.regression.joint_regression import joint_rows
from jointscope.graphs.scoring.regression.load_friction import LoadFriction, load_frictions
from jointscope.graphs.scoring.regression.regressed_causes import RegressedCause, confirmed, regressed_causes
from jointscope.graphs.scoring.regression.unsteady_gains import UnsteadyGain, explain_more, unsteady_gains
from jointscope.graphs.scoring.score_test import ScoreTest
from jointscope.robots.model.robot import Robot
from jointscope.robots.recordings.recording import Recording


@dataclass(frozen=True)
class Asked:
    """What regression says; of these at most one.

    Attributes:
        causes: effects that regression names, joint by joint, and the calibration asks for, too.
        changed: when the robot takes up or sets down a load, or is pushed; None where nothing tells of it.
        gains: drives whose constant falls with speed, command or time, which no effect of the catalogue knows.
        load_frictions: joints whose friction grows with the torque they pass on, which no effect of rigid joints knows.
    """

    causes: tuple[RegressedCause, ...] = ()
    changed: ChangedLoad | None = None
    gains: tuple[UnsteadyGain, ...] = ()
    load_frictions: tuple[LoadFriction, ...] = ()


def asked_by_regression(robot: Robot, recordings: Sequence[Recording], test: ScoreTest) -> Asked:
    """A load, a gain, or friction that changes, or effects; the first that explains most.

    Args:
        robot: calibrated, with noise of encoders as it was before a model that lacks something took a part of it.
        recordings: of the calibration.
        test: of the whole recordings, linearised at their solution with the noise used.
    """
    rows = joint_rows(robot, recordings)
    if rows is None:
        return Asked()
    changed = changed_load(rows, [recording.path for recording in recordings])
    causes, gains = confirmed(regressed_causes(rows), test), unsteady_gains(rows)
    better = [cause for cause in causes if changed and cause.joint == changed.joint]
    if changed and not any(1.0 - cause.explained < changed.left for cause in better):
        return Asked(changed=changed)
    if explain_more(gains, causes):
        return Asked(gains=gains)
    return Asked(causes=causes, load_frictions=() if causes else load_frictions(rows))
