# SPDX-License-Identifier: BSD-3-Clause
"""Rests are cut out where everything stands, and say how well their means are known."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.robots.recordings.still_stretches import LONG_PAUSE, SHORTEST, still_stretches
from jointscope.robots.rests.creep import creep_of, creeping_stretches, fastest_creep
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.robots.rests.rests import find_rests

ROBOT = load_robot("biorob")
RATE = 100.0


def recording(q_motor, q_link=None, u=None, others=0.0):
    """A recording whose joints 2 to 4 stand at zero, or their links `others` beside it; arguments of joint 1."""
    times = np.arange(len(q_motor)) / RATE
    rest = np.zeros((len(times), 3))
    motor = np.column_stack([q_motor, rest])
    link = np.column_stack([q_motor * 0.3 if q_link is None else q_link, rest + others])
    command = np.column_stack([np.zeros(len(times)) if u is None else u, rest])
    streams = {
        "command": Stream("command", times, command, ("a", "b", "c", "d"), "V"),
        "motor_encoder": Stream("motor_encoder", times, motor, ("a", "b", "c", "d"), "rad"),
        "link_encoder": Stream("link_encoder", times, link, ("a", "b", "c", "d"), "rad"),
    }
    return Recording("bench", "", 0, streams)


def steps(*levels, seconds=2.0, ramp=0.5):
    """Stands at each level and moves evenly in between."""
    found = [np.full(int(seconds * RATE), levels[0])]
    for a, b in pairwise(levels):
        found += [np.linspace(a, b, int(ramp * RATE)), np.full(int(seconds * RATE), b)]
    return np.concatenate(found)


def test_every_level_is_a_rest_with_its_means():
    rests = find_rests(recording(steps(0.0, 0.4, -0.2)), ROBOT, LoadHistory.none())
    np.testing.assert_allclose(rests.q_motor[:, 0], [0.0, 0.4, -0.2], atol=1e-12)
    np.testing.assert_allclose(rests.q_link[:, 0], [0.0, 0.12, -0.06], atol=1e-12)
    assert rests.moved[:, 0].tolist() == [False, True, True] and not rests.moved[:, 1:].any()
    assert rests.links == ("", "", "")


def test_a_link_that_swings_on_is_known_less_well_and_one_that_swings_far_is_left_out():
    t = np.arange(int(4.5 * RATE)) / RATE
    motor = steps(0.0, 0.4)
    for amplitude, kept in ((0.004, 2), (0.2, 1)):
        swing = np.where(t < 2.5, 0.0, amplitude * np.cos(2.0 * np.pi * 1.3 * (t - 2.5)))
        rests = find_rests(recording(motor, 0.3 * motor + swing), ROBOT, LoadHistory.none())
        assert len(rests) == kept and len(rests.notices) == 2 - kept
        if kept == 2:
            assert abs(rests.q_link[1, 0] - 0.12) < 3.0 * rests.link_scatter[1, 0] < amplitude
            assert rests.link_scatter[0, 0] == 0.0


def test_a_load_that_changes_ends_a_rest_and_a_motor_that_stood_has_not_moved():
    loads = LoadHistory(np.array([0.0, 2.0]), np.array([[0.0, 0, 0], [0, 1.5, 0]]), ("attachment", "attachment"))
    rests = find_rests(recording(np.zeros(400)), ROBOT, loads)
    np.testing.assert_array_equal(rests.forces[:, 1], [0.0, 1.5])
    assert rests.times[0, 1] <= 2.0 <= rests.times[1, 0] and not rests.moved.any()


@pytest.mark.parametrize(("begins", "forces"), ((2.0, [0.0, 1.5]), (0.0, [1.5]), (-3.0, [1.5]), (0.2, [1.5])))
def test_the_first_load_hangs_from_its_time_on_and_nothing_before(begins, forces):
    loads = LoadHistory(np.array([begins]), np.array([[0.0, 1.5, 0.0]]), ("attachment",))
    rests = find_rests(recording(np.zeros(400)), ROBOT, loads)
    np.testing.assert_array_equal(rests.forces[:, 1], forces)
    if begins == 2.0:
        assert rests.times[0, 1] <= 2.0 <= rests.times[1, 0] and rests.links == ("", "attachment")


def test_rests_alike_in_a_row_are_one_the_last():
    motor = steps(0.0, 0.4)
    blip = motor.copy()
    blip[350] += 0.1  # a glitch cuts the second rest in two
    rests = find_rests(recording(blip, 0.3 * motor), ROBOT, LoadHistory.none())
    assert len(rests) == 2 and rests.moved[1, 0] and rests.times[1, 0] > 3.5


def test_a_motor_that_left_and_came_back_to_the_same_place_rests_again():
    sweeps = [
        np.concatenate([np.linspace(0.4, to, 30), np.linspace(to, 0.4, 30), np.full(200, 0.4)]) for to in (0.2, 0.6)
    ]
    again = find_rests(recording(np.concatenate([np.full(200, 0.4), *sweeps])), ROBOT, LoadHistory.none())
    assert again.q_motor[:, 0] == pytest.approx([0.4, 0.4, 0.4])
    assert again.moved[:, 0].tolist() == [False, True, True] and not again.moved[:, 1:].any()


def test_motion_has_no_rests_and_weights_in_a_hurry_have_none():
    with pytest.raises(RecordingError) as err:
        find_rests(recording(np.linspace(0.0, 3.0, 500)), ROBOT, LoadHistory.none())
    assert str(err.value) == (
        "bench: no rests: no motor stands for 0.5 s; a recording of motion stands before the first option"
    )
    begins_at_rest = np.concatenate([np.zeros(100), np.linspace(0.0, 3.0, 500)])
    with pytest.raises(RecordingError, match="stand 17 % of the time only; expected rests; a recording"):
        find_rests(recording(begins_at_rest), ROBOT, LoadHistory.none())
    times = np.arange(0.0, 4.0, 0.3)
    hurried = LoadHistory(times, np.outer(times, [0, 1, 0]), ("attachment",) * len(times))
    with pytest.raises(RecordingError, match=r"the load changes within 0\.5 s wherever the motors stand"):
        find_rests(recording(np.zeros(400)), ROBOT, hurried)
    t = np.arange(400) / RATE
    with pytest.raises(RecordingError, match="a link swings through each; hold every weight for longer"):
        find_rests(recording(np.zeros(400), 0.5 * np.sin(2.0 * t)), ROBOT, LoadHistory.none())


def test_a_stretch_ends_where_a_channel_leaves_its_range_or_samples_are_missing():
    times = np.array([*np.arange(0.0, 1.0, 0.1), *np.arange(3.0, 4.0, 0.1)])
    values = np.zeros((20, 1))
    np.testing.assert_allclose(still_stretches(times, values, np.array([0.1])), [(0.0, 0.9), (3.0, 3.9)])
    values[5:, 0] = 0.05
    assert len(still_stretches(times, values, np.array([0.01]))) == 1  # half a second is too short before the step


def stretches_sample_by_sample(times, values, within):
    """The same stretches by a plain loop."""
    found, start = [], 0
    for k in range(1, len(times) + 1):
        inside = values[start : k + 1]
        if k < len(times) and times[k] - times[k - 1] <= LONG_PAUSE and np.all(np.ptp(inside, axis=0) <= within):
            continue
        if times[k - 1] - times[start] >= SHORTEST:
            found.append((times[start], times[k - 1]))
        start = k
    return found


def test_stretches_are_those_of_a_plain_loop():
    rng = np.random.default_rng(4)
    times = np.cumsum(rng.uniform(0.005, 0.015, 4000) + 0.7 * (rng.uniform(size=4000) < 0.002))
    walk = np.cumsum(rng.normal(0.0, 1.0, (4000, 3)) * (np.sin(times)[:, None] > -0.3), axis=0)
    within = np.array([15.0, 25.0, 40.0])
    expected = stretches_sample_by_sample(times, walk, within)
    assert len(expected) > 10
    np.testing.assert_array_equal(still_stretches(times, walk, within), expected)


def test_encoders_with_another_zero_read_the_same():
    zero = np.array([0.3, 0.0, 0.0, 0.0])
    moved = replace(ROBOT.motor_encoder, zero=zero)
    rests = find_rests(recording(steps(0.3, 0.7)), ROBOT.with_sensors({"motor_encoder": moved}), LoadHistory.none())
    np.testing.assert_allclose(rests.q_motor[:, 0], [0.0, 0.4], atol=1e-12)


def creeping(speed, seconds=1.5, stops=False):
    """Stands at 0.4 rad, goes on with a velocity [rad/s], and stops halfway or creeps on to the end."""
    t = np.arange(int(seconds * RATE)) / RATE
    on = 0.4 + speed * np.minimum(t, 0.5 * seconds if stops else seconds)
    return np.concatenate([steps(0.0, 0.4), on, np.linspace(on[-1], 0.8, 50), np.full(200, 0.8)])


@pytest.mark.parametrize("speed", (1e-3, -2e-3))
def test_a_motor_that_creeps_to_the_end_of_a_stretch_is_a_rest_with_its_velocity(speed):
    rests = find_rests(recording(creeping(speed)), ROBOT, LoadHistory.none())
    assert rests.q_motor[:, 0] == pytest.approx([0.0, 0.4, 0.4 + 0.75 * speed, 0.8], abs=1.1 * abs(speed))
    assert rests.creep[:, 0] == pytest.approx([0.0, 0.0, speed, 0.0], rel=0.03)
    assert rests.moved[:, 0].tolist() == [False, True, True, True] and not rests.moved[:, 1:].any()


def test_a_motor_too_fast_to_be_at_rest_or_that_stops_halfway_tells_nothing_of_its_friction():
    assert fastest_creep(ROBOT)[0] == pytest.approx(0.05 * 0.05 / 0.5808)  # damping is a twentieth of dry friction
    fast = find_rests(recording(creeping(6e-3)), ROBOT, LoadHistory.none())
    assert fast.q_motor[:, 0] == pytest.approx([0.0, 0.4, 0.8], abs=1e-5) and not fast.creep.any()
    # from 0.3 s before it stops until 0.3 s after
    stream = Stream("m", np.arange(60) / RATE, np.interp(np.arange(60), [0, 30], [0, 6e-4])[:, None], ("m",), "rad")
    speed, known = creep_of(stream, np.array([3.85e-5]), 0.0, 0.6)
    assert speed == [0.0] and not known[0]


def test_springs_whose_links_no_encoder_sees_have_no_creep():
    blind = replace(ROBOT, sensors={"motor_encoder": ROBOT.motor_encoder})
    assert blind.link_encoder is None
    assert creeping_stretches(recording(creeping(1e-3)), blind, []) == []


def test_links_that_move_on_while_motors_and_load_stand_are_told():
    motor = steps(0.0, 0.4, -0.2)
    # the force ramps, and a link with it, which /load does not say
    ramp = np.where(np.abs(np.diff(motor, prepend=0.0)) < 1e-9, 0.01, 0.0) / RATE
    rests = find_rests(recording(motor, 0.3 * motor + np.cumsum(ramp)), ROBOT, LoadHistory.none())
    (notice,) = [notice for notice in rests.notices if "moves on steadily" in notice.text]
    assert "in 3 of 3 a link moves on steadily" in notice.text and "/load does not say" in notice.text
    assert not find_rests(recording(motor, 0.3 * motor), ROBOT, LoadHistory.none()).notices


def test_links_that_another_motor_takes_along_as_it_creeps_are_no_load_that_changes():
    motor = creeping(1e-3)
    carried = 5.0 * np.clip(motor - 0.4, 0.0, 1.5e-3)  # the weight moves that these carry
    rests = find_rests(recording(motor, 0.3 * motor, others=carried[:, None]), ROBOT, LoadHistory.none())
    assert rests.creep[:, 0].max() > 9e-4 and not rests.notices
