# SPDX-License-Identifier: BSD-3-Clause
"""Currents that stop, belong to other joints or have no common delay are told before anything is computed."""

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.screening.current_delay import with_current_delay
from jointscope.graphs.screening.mistaken_currents import mistaken_currents
from jointscope.graphs.screening.screen_all import screen_all
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from tests.graphs.calibration.test_motor_currents import changed, simulated, with_currents


@pytest.fixture(scope="module")
def robot():
    return with_currents(load_robot("doggy"))


@pytest.fixture(scope="module")
def recording(robot):
    return simulated(robot).recording


def frozen(recording, since, stop=np.inf):
    """The same with the currents of one time kept from then on [s]."""
    stream = recording.streams["current"]
    stands = (stream.times > since) & (stream.times < stop)
    return changed(recording, np.where(stands[:, None], stream.values[stands][0], stream.values))


def test_currents_that_stop_while_commands_go_on_are_refused(robot, recording):
    said = r"current repeats one sample from 1\.2\d+ to 1\.99\d s: the sensor has stopped; .* or remove current from"
    with pytest.raises(RecordingError, match=said):
        screen_all(frozen(recording, 1.2), robot)


def test_currents_that_repeat_themselves_while_the_commands_stand_are_no_failure(robot, recording):
    command = recording.command
    still = (command.times > 0.5) & (command.times < 1.0)
    held = replace(command, values=np.where(still[:, None], command.values[still][0], command.values))
    there = frozen(replace(recording, streams={**recording.streams, "command": held}), 0.5, 1.0)
    assert not any("stopped" in notice.text for notice in screen_all(there, robot))


def test_currents_that_no_drive_of_theirs_explains_are_named(robot, recording):
    i = recording.streams["current"].values
    (said,) = mistaken_currents(changed(recording, i[:, [0, 0, 2]]), robot)
    assert "commands and speeds of joint2 leave 9" in said.text and "or remove sensors.current from doggy" in said.text
    noise = 0.02 * np.random.default_rng(1).normal(size=i.shape)
    assert mistaken_currents(changed(recording, noise), robot) == []  # nothing flowed, which is no contradiction


def test_recordings_with_another_delay_each_are_refused_also_where_their_gaps_touch(robot, recording):
    late = simulated(robot, 0.0012).recording
    assert with_current_delay(robot, [recording, recording])[0].motor_current.delay == 0.0
    assert with_current_delay(robot, [late, late])[0].motor_current.delay == pytest.approx(0.0015, abs=1e-5)
    said = r"currents are late by 0 to 1 ms in \S+ and 1 to 2 ms in \S+, and one delay has to serve all of them; "
    for pair in ([recording, late], [late, recording]):
        with pytest.raises(RecordingError, match=said):
            with_current_delay(robot, pair)
    kept = robot.with_sensors({"current": replace(robot.motor_current, estimate_delay=False)})
    assert with_current_delay(kept, [recording, late]) == (kept, [])


def test_irregular_stamps_of_one_delay_are_no_contradiction(robot):
    both = [simulated(robot, 0.002, jitter=jitter).recording for jitter in (2e-4, 1e-4)]
    assert with_current_delay(robot, both)[0].motor_current.delay == pytest.approx(0.002, abs=5e-5)


@pytest.mark.parametrize("steps", [3.0, 15.0])
def test_smoothed_currents_are_named_with_how_long(robot, recording, steps):
    i = recording.streams["current"].values.copy()
    for k in range(1, len(i)):  # a drive that filters, at 1 kHz
        i[k] = i[k - 1] + (1.0 - np.exp(-1.0 / steps)) * (i[k] - i[k - 1])
    said = mistaken_currents(changed(recording, i), robot)
    found = [float(notice.text.split("about ")[1].split()[0]) for notice in said if "smoothed, over" in notice.text]
    assert len(found) == 1 and 0.6 * steps < found[0] < 1.5 * steps, said
    assert mistaken_currents(recording, robot) == []
