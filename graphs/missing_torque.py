# SPDX-License-Identifier: BSD-3-Clause
"""The torque that a model lacks in each equation of motion, over time, beside the motion at which it appeared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MissingTorque:
    """A smoothed torque per equation.

    Attributes:
        joints: names of the n joints.
        rows: names of the 2n equations, links first: "joint1.link", ..., "joint1.motor", ...
        times: ticks, shape (m,) [s].
        torque: to be added to the right-hand side of each equation, shape (m, 2n) [N m].
        sigma: its standard deviation, shape (m, 2n) [N m].
        q_link, v_link, q_motor, v_motor: smoothed motion, shape (m, n) each [rad], [rad/s].
        tau_spring: torque of each spring, shape (m, n) [N m].
        tau_drive: torque of each motor without friction, shape (m, n) [N m].
        explained_by: curves of the best candidates: label to torque of the row it acts on, shape (m, 2n).
    """

    joints: tuple[str, ...]
    rows: tuple[str, ...]
    times: Array
    torque: Array
    sigma: Array
    q_link: Array
    v_link: Array
    q_motor: Array
    v_motor: Array
    tau_spring: Array
    tau_drive: Array
    explained_by: dict[str, Array]
