# SPDX-License-Identifier: BSD-3-Clause
"""Torques behind a low-pass and torques after a delay are told apart, with the size; those at once are neither."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_arm import STEP, Arm, divided, moved

from jointscope.graphs.scoring.regression.asked_by_regression import most_plausible
from jointscope.graphs.scoring.regression.joint_regression import joint_rows
from jointscope.graphs.scoring.regression.late_drives import DELAY, LAG, late_drives
from jointscope.robots.recordings.recording import Recording

ARM = Arm()
CONSTANTS = (8.0, 5.0, 2.0)  # [N m/A]


def rows_of(robot, **how):
    encoder, command = moved(ARM, **{"seconds": 8.0, "encoder_rate": 250.0, "command_rate": 250.0, **how})
    if robot.command.unit == "A":
        command = divided(command, CONSTANTS)
    return joint_rows(robot, [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])


def behind_a_low_pass(time_constant):
    state, stays = np.zeros(3), np.exp(-STEP / time_constant)

    def drive(_, u, __, ___):
        mean = u + (state - u) * time_constant / STEP * (1.0 - stays)
        state[:] = u + (state - u) * stays
        return mean

    return drive


def after_a_delay(delay):
    sent = []

    def drive(_, u, __, ___):
        sent.append(u)
        return sent[max(len(sent) - 1 - round(delay / STEP), 0)]

    return drive


@pytest.mark.parametrize("unit", ["N m", "A"])
@pytest.mark.parametrize(
    ("late", "effect", "size"), [(behind_a_low_pass, LAG, 0.008), (after_a_delay, DELAY, 0.006)], ids=["lag", "delay"]
)
def test_what_makes_torques_late_is_told_with_its_size(robots, unit, late, effect, size):
    rows = rows_of(robots[unit], drive=late(size))
    found = late_drives(rows)
    assert found.effect == effect and found.clearly
    assert found.size == pytest.approx(size, rel=0.05)
    assert most_plausible(rows, ["arm.mcap"], ()).lag == found


@pytest.mark.parametrize("how", [{}, {"push": (4.0, 4.6, 1, 8.0)}, {"cable": 3.0}], ids=["clean", "push", "cable"])
def test_what_is_not_late_is_not_called_so(robots, how):
    assert most_plausible(rows_of(robots["N m"], **how), ["arm.mcap"], ()).lag is None
