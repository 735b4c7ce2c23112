# SPDX-License-Identifier: BSD-3-Clause
"""Pushes that nobody logged: they are told from laws of the robot, and a calibration without them is as good as new."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.calibration.external_torque import BIN, external_torques
from jointscope.robots.recordings.recording import Recording, Stream

SECONDS, TICK = 20.0, 2e-3
PUSHED = 9.0, 9.3  # [s]
TORQUE = 15.0  # [N m]


@pytest.fixture(scope="module")
def motion(doggy):
    """Joints that swing at incommensurable rates, with small random torques that no law explains."""
    ticks = np.arange(0.0, SECONDS, TICK)
    rng = np.random.default_rng(4)
    omega = np.array([2.1, 2.9, 3.7])
    q = 0.6 * np.sin(omega * ticks[:, None] + np.arange(3)) + 0.2 * np.sin(0.37 * omega * ticks[:, None])
    v = np.gradient(q, ticks, axis=0)
    bend = 2e-3 * np.gradient(v, ticks, axis=0)
    x = np.zeros((len(ticks), doggy.layout.size))
    x[:, doggy.layout.joint_q], x[:, doggy.layout.joint_v] = q + bend, v
    x[:, doggy.layout.motor_q], x[:, doggy.layout.motor_v] = q, v
    command = Stream("command", ticks, np.ones((len(ticks), 3)), ("1", "2", "3"), "1")
    encoder = Stream("motor_encoder", ticks, q, ("1", "2", "3"), "rad")
    recording = Recording("swing.mcap", "", 0, {"command": command, "motor_encoder": encoder})
    return SimpleNamespace(ticks=ticks, q=q, v=v, x=x, recording=recording, noise=rng.normal(0.0, 0.2, q.shape))


def found(doggy, motion, torque, recording=None):
    """Moments found where the equations of the links lack a torque, shape (m, 3) [N m], beside the random one."""
    M = doggy.kinematic_tree.mass_matrix(np.zeros((1, 3)))[0]
    acceleration = (torque + motion.noise)[:-1] * np.diag(np.linalg.inv(M))
    return external_torques(doggy, recording or motion.recording, motion.ticks, motion.x, acceleration * TICK)


def push(motion, joint):
    """A hand on one link."""
    torque = np.zeros_like(motion.q)
    torque[(motion.ticks >= PUSHED[0]) & (motion.ticks < PUSHED[1]), joint] = TORQUE
    return torque


@pytest.mark.parametrize("joint", range(3))
def test_a_push_is_found_when_and_where_it_was(doggy, motion, joint):
    (moment,) = found(doggy, motion, push(motion, joint))
    assert moment.row == f"joint{joint + 1}.link"
    assert PUSHED[0] - 2 * BIN <= moment.t0 <= PUSHED[0]
    assert PUSHED[1] <= moment.t1 <= PUSHED[1] + 2 * BIN
    assert moment.torque == pytest.approx(TORQUE, rel=0.05)


LAWS = {
    "stop": lambda m: -60.0 * np.clip(np.abs(m.q) - 0.7, 0.0, None) * np.sign(m.q),
    "friction at low speed": lambda m: -3.0 * np.sign(m.v) * np.exp(-((m.v / 0.05) ** 2)),
    "gravity": lambda m: 5.0 * np.cos(m.q),
    "drag": lambda m: -0.5 * m.v * np.abs(m.v),
    "other joint": lambda m: 2.0 * m.v[:, [1, 2, 0]] ** 2,
    "nothing": lambda m: 0.0 * m.q,
}


@pytest.mark.parametrize("name", LAWS)
def test_no_law_is_taken_for_a_push(doggy, motion, name):
    assert found(doggy, motion, LAWS[name](motion)) == ()


@pytest.mark.parametrize("name", ["friction at low speed", "drag"])
def test_a_push_is_found_beside_a_missing_law(doggy, motion, name):
    (moment,) = found(doggy, motion, LAWS[name](motion) + push(motion, 1))
    assert moment.row == "joint2.link" and moment.t0 <= PUSHED[0] and moment.t1 >= PUSHED[1]


def test_a_torque_that_matters_to_nobody_is_no_push_however_clearly_it_stands_out(doggy, motion):
    """0.15 N m where the motors give more than 50, in a recording without any noise."""
    quiet = SimpleNamespace(**{**vars(motion), "noise": 1e-4 * motion.noise})
    assert found(doggy, quiet, 0.01 * push(motion, 1)) == ()
    (moment,) = found(doggy, quiet, push(motion, 1))
    assert moment.row == "joint2.link"


def test_what_is_left_out_already_is_not_told_again(doggy, motion):
    without = motion.recording.leaving_out([PUSHED])
    assert found(doggy, motion, push(motion, 0), without) == ()


def test_short_recordings_say_nothing(doggy, motion):
    early = motion.recording.between(0.0, 2.0)
    count = int(2.0 / TICK)
    ticks, x = motion.ticks[:count], motion.x[:count]
    assert external_torques(doggy, early, ticks, x, np.ones((count - 1, 3))) == ()


@pytest.fixture(scope="module")
def pushed(doggy):
    """A simulated Doggy that somebody pushes, calibrated as it is and without that moment."""
    pytest.importorskip("mujoco", reason="the simulator needs the extra `sim`")
    from jointscope.graphs.calibration.calibrate import calibrate
    from jointscope.tools.simulator import simulate

    effect = f"push@joint2:torque={TORQUE:g},time=5,duration=0.3"
    recording = simulate(doggy, "calibration", 8.0, seed=3, friction="smooth", effects=[effect]).recording
    clean = simulate(doggy, "calibration", 8.0, seed=3, friction="smooth").recording
    near = doggy.with_values({name: p.published for name, p in doggy.parameters.items() if p.published is not None})
    whole = calibrate(near, [recording])
    (moment,) = whole.bags[0].isolated
    without = calibrate(near, [recording.leaving_out([(moment.t0, moment.t1)])])
    return SimpleNamespace(whole=whole, moment=moment, without=without, clean=calibrate(near, [clean]))


@pytest.mark.slow
def test_calibrations_name_the_push_and_how_to_leave_it_out(pushed):
    assert pushed.moment.row == "joint2.link" and pushed.moment.t0 <= 5.05 and pushed.moment.t1 >= 5.25
    assert any("--leave-out" in text and "joint2.link" in text for text in pushed.whole.findings)
    assert not any("--leave-out" in text for text in pushed.without.findings)


@pytest.mark.slow
def test_without_the_push_the_noise_is_that_of_a_clean_recording(pushed):
    noise, clean = pushed.without.noise.link_velocity, pushed.clean.noise.link_velocity
    assert pushed.whole.noise.link_velocity[1] > 10.0 * clean[1]
    assert np.all(noise < 1.5 * clean)


@pytest.mark.slow
def test_without_the_push_values_are_those_of_a_clean_recording(pushed):
    values, clean, bent = (
        {p.name: p for p in result.parameters} for result in (pushed.without, pushed.clean, pushed.whole)
    )
    of_robot = [name for name in values if name in pushed.clean.robot.parameters]
    apart = {name: abs(values[name].value - clean[name].value) / values[name].sigma for name in of_robot}
    assert max(apart.values()) < 3.0
    # and they are known nearly as well, where the push had widened every sigma
    assert all(values[name].sigma < 1.5 * clean[name].sigma for name in of_robot)
    assert np.median([bent[name].sigma / clean[name].sigma for name in of_robot]) > 2.0


@pytest.mark.slow
def test_no_model_is_judged_where_something_was_left_out(pushed, doggy):
    from jointscope.graphs.comparison.compare import compare_model

    recording = pushed.without.bags[0].recording
    compared = compare_model("model", pushed.without.robot, recording)
    assert compared.error < 1.2 * compared.floor
    assert compared.isolated == ()
    ends = compared.sensors["motor_encoder"].times[np.isfinite(compared.sensors["motor_encoder"].ahead[:, 0])]
    assert not np.any((ends >= pushed.moment.t0) & (ends <= pushed.moment.t1 + 0.5))
    assert np.any(ends < pushed.moment.t0) and np.any(ends > pushed.moment.t1 + 0.6)
