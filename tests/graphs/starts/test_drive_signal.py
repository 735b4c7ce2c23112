# SPDX-License-Identifier: BSD-3-Clause
"""Commands that act until the next one and signals that were measured are told apart by the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slow_pendulum import pendulum, recorded, swing

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.starts.drive_signal import with_known_drive_signal

BESIDE, APART = "/js", "/cmd"  # the positions' own topic, and another one


@pytest.fixture(scope="module", params=[False, True], ids=["held", "measured"])
def swung(request):
    """Whether the current was measured, and the recording."""
    stamps, currents, angles = swing(4.0, 100.0, smooth_drive=request.param)
    noise = 1e-5 * np.random.default_rng(2).standard_normal(angles.shape)
    return request.param, recorded(stamps, currents, angles + noise)


@pytest.mark.parametrize("topic", [BESIDE, APART])
def test_the_motion_says_what_the_place_does_not(swung, topic, tmp_path):
    measured, recording = swung
    robot = with_known_drive_signal(pendulum(tmp_path, 1e-5, topic=topic), [recording])
    assert robot.command_held == (not measured)


def test_the_robot_file_keeps_the_word(swung, tmp_path):
    measured, recording = swung
    said = pendulum(tmp_path, 1e-5, held=f", held: {str(measured).lower()}")
    assert with_known_drive_signal(said, [recording]) is said


def test_where_nothing_is_explained_the_place_decides(swung, tmp_path):
    _, recording = swung
    command = recording.command
    lost = replace(command, values=np.random.default_rng(1).standard_normal(command.values.shape))
    robot = pendulum(tmp_path, 1e-5, topic=BESIDE)
    known = with_known_drive_signal(robot, [replace(recording, streams={**recording.streams, "command": lost})])
    assert known is robot


def test_a_command_echoed_beside_the_positions_calibrates_right_and_the_file_says_so(tmp_path):
    stamps, currents, angles = swing(4.0, 100.0)
    noise = 1e-5 * np.random.default_rng(2).standard_normal(angles.shape)
    result = calibrate(pendulum(tmp_path, 1e-5, topic=BESIDE), [recorded(stamps, currents, angles + noise)])
    found = {p.name: p for p in result.parameters}
    for name, true in (("swing.torque_constant", 2.0), ("swing.motor_viscous.coefficient", 0.4)):
        assert abs(found[name].value - true) < max(3.5 * found[name].sigma, 0.01 * true), name
    assert result.robot.command.held is True
    assert any("acts until the next one" in said for said in result.findings)
