# SPDX-License-Identifier: BSD-3-Clause
"""Everything that asks for the notices of a recording gets those of one screening."""

from __future__ import annotations

import pickle
from dataclasses import replace

import pytest
from slow_pendulum import pendulum, recorded, swing

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.screening import screen_all as module
from jointscope.graphs.screening.screen_all import screen_all


@pytest.fixture
def asked(monkeypatch):
    """Robots that were screened, one for each time."""
    robots, screened = [], module._screened
    monkeypatch.setattr(module, "_screened", lambda rec, robot: robots.append(robot) or screened(rec, robot))
    return robots


@pytest.fixture
def recording():
    return recorded(*swing(3.0, 100.0))


def test_a_look_before_a_calibration_is_the_screening_of_the_calibration(asked, recording, tmp_path):
    robot = pendulum(tmp_path, 1e-5, held=", held: true")
    first = screen_all(recording, robot)
    calibrate(robot, [recording])
    assert len(asked) == 1 and screen_all(recording, robot) == first


def test_another_robot_another_recording_and_another_stream_are_screened(asked, recording, tmp_path):
    robot = pendulum(tmp_path, 1e-5, held=", held: true")
    screen_all(recording, robot)
    screen_all(recording, replace(robot))
    screen_all(replace(recording), robot)
    command = recording.command
    recording.streams["command"] = replace(command, values=0.5 * command.values)
    screen_all(recording, robot)
    assert len(asked) == 4


def test_a_changed_copy_begins_without_screenings_and_a_recording_is_equal_to_itself_after_one(recording, tmp_path):
    screen_all(recording, pendulum(tmp_path, 1e-5, held=", held: true"))
    assert len(recording.screenings) == 1 and not replace(recording).screenings
    assert pickle.loads(pickle.dumps(recording)).notices == recording.notices
