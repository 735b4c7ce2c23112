# SPDX-License-Identifier: BSD-3-Clause
"""End stops that MuJoCo has are found where they are, and where none is, none is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import Arm, assert_right, moved, robot_file

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.starts.end_stops import end_stops
from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording
from jointscope.tools.bags.read_recording import with_end_stops_left_out
from jointscope.tools.verdicts.judgement import judge

ARM = Arm("yx", inertia=(0.7, 0.2), dry=(2.0, 0.8), viscous=(1.5, 0.6))
UPPER, LOWER = 0.3, -0.25  # [rad] from the middle of the motion


@pytest.fixture
def robot(tmp_path):
    return load_robot(robot_file(ARM, tmp_path))


def recorded(arm=ARM, **how):
    how = {"encoder_rate": 200.0, "command_rate": 200.0, **how}
    encoder, command = moved(arm, **how)
    return Recording("arm.mcap", "", 10**18, {"encoder": encoder, "command": command})


def middle(joint, seed=1):
    """Where the motion of a joint begins."""
    return moved(ARM, seed=seed, seconds=0.1)[0].values[0, joint]


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
@pytest.mark.parametrize(("stop", "at"), [((1, -9.0, UPPER), UPPER), ((1, LOWER, 9.0), LOWER), ((0, -9.0, 0.2), 0.2)])
def test_a_stop_is_found_where_it_is(robot, stop, at, rate):
    recording = recorded(stop=stop, encoder_rate=rate, command_rate=rate)
    (found,) = end_stops(robot, recording)
    assert found.joint == ARM.joints[stop[0]]
    assert found.at == pytest.approx(middle(stop[0]) + at, abs=0.01)
    # everything that lies beyond is left out
    encoder = recording.streams["encoder"]
    beyond = np.sign(at) * (encoder.values[:, stop[0]] - middle(stop[0]) - at) > 1e-3
    left_out = np.any([(encoder.times >= a) & (encoder.times <= b) for a, b in found.stretches], axis=0)
    assert np.all(left_out[beyond])
    assert np.mean(left_out) < np.mean(beyond) + 0.3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_stops_at_both_ends(robot, seed):
    lower, upper = -0.15, 0.2  # every one of these motions comes to both
    found = end_stops(robot, recorded(stop=(1, lower, upper), seed=seed))
    places = sorted(stop.at - middle(1, seed) for stop in found)
    assert places == pytest.approx([lower, upper], abs=0.015)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
@pytest.mark.parametrize(
    "how",
    [{}, {"sticks": True}, {"counts": 4096}, {"noise": 1e-3}, {"pause": 0.4, "sticks": True}, {"encoder_rate": 50.0}],
)
def test_a_joint_that_merely_turns_over_has_none(robot, how, seed):
    assert end_stops(robot, recorded(seed=seed, **how)) == ()


@pytest.mark.parametrize("seed", range(1, 7))
@pytest.mark.parametrize("noise", [2e-5, 3e-4])
def test_a_recording_that_ends_at_the_end_of_a_way_shows_no_stop(robot, seed, noise):
    recording = recorded(seed=seed, noise=noise)
    encoder = recording.streams["encoder"]
    late = encoder.times > 4.0
    last = float(encoder.times[late][np.argmax(encoder.values[late, 1])])
    assert end_stops(robot, recording.between(0.0, last + 0.02)) == ()


def test_a_command_of_another_unit_or_that_acts_late_is_no_stop(robot):
    recording = recorded()
    late = replace(recording.command, times=recording.command.times + 0.02)
    amperes = replace(recording.command, values=recording.command.values / 7.0)
    for command in (late, amperes):
        assert end_stops(robot, replace(recording, streams={**recording.streams, "command": command})) == ()


def test_a_spring_that_the_model_lacks_is_no_stop(robot):
    """A cable pulls more the farther the joint goes: at both ends, and on the way, too."""
    recording = recorded()
    place = recording.streams["encoder"].values[:, 1]
    pull = np.interp(recording.command.times, recording.streams["encoder"].times, place - middle(1))
    values = recording.command.values.copy()
    values[:, 1] += 15.0 * pull + 60.0 * pull**3
    cable = {**recording.streams, "command": replace(recording.command, values=values)}
    assert end_stops(robot, replace(recording, streams=cable)) == ()


@pytest.mark.slow
def test_a_calibration_without_the_contacts_is_right_and_says_so(robot):
    recording = with_end_stops_left_out(recorded(stop=(1, -9.0, UPPER)), robot)
    result = calibrate(robot, [recording])
    assert_right(ARM, result.parameters, rel=0.005)
    assert judge(result).level == "good"
    assert any("j1 presses" in text and "left out there" in text for text in result.findings)


def test_a_recording_of_which_nothing_would_be_left_is_refused(robot):
    recording = recorded(stop=(1, -9.0, UPPER), seed=3)
    (found,) = end_stops(robot, recording)
    free = np.append(0.0, [t1 for _, t1 in found.stretches]), np.append([t0 for t0, _ in found.stretches], 7.9)
    most = recording.leaving_out([(a, a + 0.8 * (b - a)) for a, b in zip(*free, strict=True) if b - a > 0.1])
    with pytest.raises(RecordingError, match=r"j1 presses .* end stop .* would be left"):
        with_end_stops_left_out(most, robot)
