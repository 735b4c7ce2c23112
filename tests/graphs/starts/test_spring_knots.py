# SPDX-License-Identifier: BSD-3-Clause
"""Knots of springs' curves are placed where encoders saw the springs deflected, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import hanging, lever

from jointscope.graphs.rests.rests_beside_motion import weighted_rests
from jointscope.graphs.starts.spring_knots import with_knots
from jointscope.robots.files.effect_editing import add_effect, remove_effect
from jointscope.robots.recordings.recording import Recording, Stream

KNOTS = ("swing.spring_pieces_2.forward", "swing.spring_pieces_2.backward")


@pytest.fixture
def with_pieces(tmp_path):
    return add_effect(remove_effect(lever(tmp_path), "spring_curve@swing"), "spring_pieces_2@swing")


def test_knots_that_nobody_chose_lie_at_the_ends_of_the_range_and_are_held(with_pieces):
    rests = hanging(20, 1)
    d = rests.q_link - rests.q_motor
    found = with_knots(with_pieces, [rests])
    values = [found.parameters[name].value for name in KNOTS]
    np.testing.assert_allclose(values, [d.max(), -d.min()])
    assert all(found.parameters[name].fixed for name in KNOTS)
    twice = replace(rests, q_link=rests.q_motor + 2.0 * d)
    wider = with_knots(with_pieces, [rests, twice])
    np.testing.assert_allclose([wider.parameters[name].value for name in KNOTS], [2.0 * d.max(), -2.0 * d.min()])


def test_a_side_that_was_never_loaded_has_a_tenth_of_the_other(with_pieces):
    rests = hanging(20, 1)
    ahead = replace(rests, q_link=rests.q_motor + np.abs(rests.q_link - rests.q_motor))
    found = with_knots(with_pieces, [ahead])
    far = np.max(ahead.q_link - ahead.q_motor)
    np.testing.assert_allclose([found.parameters[name].value for name in KNOTS], [far, 0.1 * far])


def test_knots_that_a_file_holds_stay(with_pieces):
    chosen = {name: replace(with_pieces.parameters[name], value=0.3, fixed=True) for name in KNOTS}
    robot = replace(with_pieces, parameters={**with_pieces.parameters, **chosen})
    assert with_knots(robot, [hanging(20, 1)]) is robot


def test_without_encoders_on_the_links_knots_stay_where_the_file_has_them(with_pieces):
    found = with_knots(with_pieces, [replace(hanging(20, 1), q_link=None)])
    assert [found.parameters[name].value for name in KNOTS] == [0.05, 0.05]
    assert all(found.parameters[name].fixed for name in KNOTS)


def moving(link_angle, motor_angle) -> Recording:
    """A lever whose encoders were read 100 times a second."""
    times = 0.01 * np.arange(len(link_angle))
    readings = {"motor_angle": motor_angle, "link_angle": link_angle, "command": 0.0 * link_angle}
    streams = {name: Stream(name, times, q[:, None], ("swing",), "rad") for name, q in readings.items()}
    return Recording("moves", "moves", 10**18, streams)


def test_zeros_of_encoders_and_what_is_left_out_move_no_knots(with_pieces):
    q = np.sin(0.05 * np.arange(400))
    bend = np.where(q > 0.0, 0.03, 0.02) * q
    pushed = bend + np.where((np.arange(400) > 100) & (np.arange(400) < 110), 0.4, 0.0)
    link = replace(with_pieces.link_encoder, zero=np.array([0.7]))
    motor = replace(with_pieces.motor_encoder, zero=np.array([-0.2]))
    robot = with_pieces.with_sensors({link.name: link, motor.name: motor})
    recording = moving(q + pushed + 0.7, q - 0.2).leaving_out([(0.95, 1.15)])
    values = [with_knots(robot, [recording]).parameters[name].value for name in KNOTS]
    np.testing.assert_allclose(values, [bend.max(), -bend.min()], rtol=1e-6)


def test_motion_and_rests_in_one_graph_have_the_same_knots(with_pieces):
    rests = hanging(40, 1)
    d, (motor, link) = rests.q_link - rests.q_motor, with_pieces.sensors
    t = np.linspace(0.0, 5.0, 501)
    q_motor = np.sin(t)[:, None]
    deflection = 0.5 * d.max() * np.sin(3.0 * t)[:, None]  # less than at rest to one side, more or less to the other
    streams = {
        motor: Stream(motor, t, q_motor, ("swing.motor_position",), "rad"),
        link: Stream(link, t, q_motor + deflection, ("swing.link_position",), "rad"),
    }
    moves = Recording("moves", "", 0, streams)
    robot, (problem,) = weighted_rests(with_pieces, [moves], [rests], lambda text, share: None)
    expected = [d.max(), max(-d.min(), -deflection.min())]
    for each in (robot, problem.robot, with_knots(robot, [moves])):  # a calibration of the motion leaves them there
        np.testing.assert_allclose([each.parameters[name].value for name in KNOTS], expected, rtol=1e-3)
        assert all(each.parameters[name].fixed for name in KNOTS)
    assert weighted_rests(with_pieces, [moves], [], lambda text, share: None) == (with_pieces, [])
