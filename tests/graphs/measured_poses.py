# SPDX-License-Identifier: BSD-3-Clause
"""Pose recordings that no code of this project made."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from jointscope.robots.recordings.poses import Poses

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
TX90L = SHARED / "data" / "tx90l"
PANDA = SHARED / "data" / "real" / "panda_sockets"


def table(name: str) -> Poses:
    """Means of the poses of a set that another program simulated."""
    rows = list(csv.reader((TX90L / name / "poses.csv").open()))[1:]
    values = np.array(rows, float)
    names = tuple(str(int(row[0])) for row in values)
    return Poses(name, "", names, values[:, 1:7], values[:, 13:16], torque=values[:, 7:13])
