# SPDX-License-Identifier: BSD-3-Clause
"""Of a sample that lacks a channel the others are used, and what stands there instead is no measurement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointscope.graphs.calibration.calibrate import calibrate
from jointscope.graphs.comparison.compare import compare
from jointscope.graphs.problem.bag_problem import BagProblem
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.simulator.simulation import simulate


@pytest.fixture(scope="module")
def run():
    robot = load_robot("doggy")
    return robot, simulate(robot, seconds=2.0, seed=4).recording


def spoilt(recording, lost, value):
    """The recording with some channels filled in with a value that nobody may believe."""
    streams = dict(recording.streams)
    for name, (rows, channel) in lost.items():
        stream = streams[name]
        filled = np.zeros(stream.values.shape, bool)
        filled[rows, channel] = True
        streams[name] = replace(stream, values=np.where(filled, stream.values + value, stream.values), filled=filled)
    return replace(recording, streams=streams)


LOST = {"motor_encoder": (slice(100, None, 3), 1), "imu1": (slice(150, None, 4), 2)}


def test_every_channel_that_was_measured_is_placed_once(run):
    robot, recording = run
    problem = BagProblem.of(robot, spoilt(recording, LOST, 0.0))
    for name in robot.sensors:
        stream = problem.recording.streams[name]
        seen = np.zeros(stream.values.shape, int)
        for placed in problem.sensors:
            if placed.factor.name == name:
                rows = np.searchsorted(stream.times, placed.times)
                columns = [stream.channels.index(row) for row in placed.factor.rows]
                seen[np.ix_(rows, columns)] += 1
        inside = (stream.times >= problem.timeline.ticks[0]) & (stream.times <= problem.timeline.ticks[-1])
        expected = np.ones(stream.values.shape, int) if stream.filled is None else (~stream.filled).astype(int)
        np.testing.assert_array_equal(seen, expected * inside[:, None])


def test_what_is_filled_in_changes_no_result(run):
    robot, recording = run
    # a little off the truth, so that starts and thresholds stay the same
    with_splines, with_errors = (calibrate(robot, [spoilt(recording, LOST, value)]) for value in (0.0, 2e-5))
    whole = calibrate(robot, [recording])
    for name, found in with_errors.robot.parameters.items():
        if found.sigma:
            before, all_of_it = with_splines.robot.parameters[name], whole.robot.parameters[name]
            assert abs(found.value - before.value) < 1e-2 * found.sigma, name
            assert abs(found.value - all_of_it.value) < 3.0 * found.sigma, name
            assert found.sigma > 0.99 * all_of_it.sigma, name


def test_predictions_are_not_held_against_what_is_filled_in(run):
    robot, recording = run
    clean = compare({"doggy": robot}, spoilt(recording, LOST, 0.0)).models[0]
    wrong = compare({"doggy": robot}, spoilt(recording, LOST, 2e-5)).models[0]
    for channel in ("joint2.motor_position", "imu1.z"):
        a, b = clean.channels[channel], wrong.channels[channel]
        assert b.horizons["0.1"] == pytest.approx(a.horizons["0.1"], rel=1e-6)
        assert b.fit_percent == pytest.approx(a.fit_percent, rel=1e-6)
