# SPDX-License-Identifier: BSD-3-Clause
"""The fixed-lag estimator where it belongs: between the sensors of a moving robot and its controller."""

import numpy as np
import pytest

from jointscope.graphs.fixed_lag.estimator import FixedLagEstimator
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.closed_loop.run_closed_loop import LoopOptions, run_closed_loop
from jointscope.tools.report.sections.closed_loop.loop_answer import loop_judgement

pytestmark = pytest.mark.slow

pytest.importorskip("mujoco", reason="the simulator needs the extra jointscope[sim]")


@pytest.fixture(scope="module")
def result():
    return run_closed_loop(load_robot("doggy"), None, 3.0, 3, options=LoopOptions(("state_feedback",)))


def test_the_head_comes_closer_to_the_ball_than_with_differentiated_encoders(result):
    true, estimator, encoders = (
        result.run("state_feedback", source).tracking for source in ("true", "estimator", "encoders")
    )
    assert estimator.hit_position < 0.5 * encoders.hit_position
    assert estimator.link_position_rms < 0.5 * encoders.link_position_rms
    assert estimator.hit_position < true.hit_position + 1e-3  # [m]
    assert estimator.chatter < 0.5 * encoders.chatter


def test_it_knows_the_velocities_of_the_links_ten_times_better_than_encoders_do(result):
    estimator, encoders = (result.run("state_feedback", source).tracking for source in ("estimator", "encoders"))
    assert estimator.estimation["v_link"] < 0.1 * encoders.estimation["v_link"]
    assert estimator.estimation["q_motor"] < 0.2 * encoders.estimation["q_motor"]


def test_the_answer_says_so(result):
    answer = loop_judgement(result)
    assert answer.level == "good"
    assert "times closer than with differentiated encoders" in answer.headline


def test_the_bag_of_the_loop_gives_the_same_states_again(result):
    """Messages in the order of their arrival, each command after what had arrived at its tick."""
    run, estimator = result.run("state_feedback", "estimator"), FixedLagEstimator(result.model, result.lag)
    messages = [
        (received, stream.name, stamp, values)
        for stream in run.recording.streams.values()
        if stream.name != "command"
        for received, stamp, values in zip(stream.received, stream.times, stream.values, strict=True)
    ]
    messages.sort(key=lambda message: message[0])
    command, n, known, place = run.recording.command, result.robot.n, [], 0
    for tick, now in enumerate(command.times[:1500]):
        while place < len(messages) and messages[place][0] <= now + 1e-9:
            estimator.sample(*messages[place][1:])
            place += 1
        known.append(estimator.state(now).mean)
        estimator.command(now, command.values[tick])
    estimates = result.model.layout.by_joint(np.array(known))[100:]
    np.testing.assert_allclose(estimates[:, : 4 * n], run.estimates[100:1500], atol=1e-7)
