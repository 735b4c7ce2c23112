# SPDX-License-Identifier: BSD-3-Clause
"""A joint that stands tells nothing by its equation of motion."""

from types import SimpleNamespace

import numpy as np
import pytest

from jointscope.graphs.problem.standstill import holding_motors, leaving_standstill_out, near, slowest_speed
from jointscope.robots.recordings.recording import Recording, Stream

PERIOD, SIGMA = 4e-3, 1e-5


def test_dry_friction_is_a_sign_from_the_slowest_speed_on():
    v = np.full(100, 0.1)
    assert np.tanh(2000.0 * slowest_speed(v, 2000.0)) > 0.99
    assert slowest_speed(v, 1e9) == 1e-4


def test_a_mask_is_widened_on_both_sides():
    mask = np.zeros(9, dtype=bool)
    mask[4] = True
    np.testing.assert_array_equal(np.flatnonzero(near(mask, 2)), [2, 3, 4, 5, 6])
    np.testing.assert_array_equal(near(mask, 0), mask)


@pytest.fixture
def stopping():
    """A joint that moves with 0.5 rad/s, stands from 1 to 1.5 s, comes back, and crosses zero at once at 2.5 s."""
    times = np.arange(0.0, 4.0, PERIOD)
    v = np.select([times < 1.0, times < 1.5, times < 2.5], [0.5, 0.0, -0.5], 0.5)
    q = PERIOD * np.cumsum(v)
    command = Stream("command", times, np.ones((len(times), 1)), ("j",), "N m")
    encoder = Stream("encoder", times, q[:, None], ("j.motor_position",), "rad")
    return Recording("stop.mcap", "", 0, {"command": command, "encoder": encoder})


def joint(sigma=SIGMA, sharpness=200.0, parameters=(), motors=(), fixed=()):
    """What of a robot counts."""
    encoder = SimpleNamespace(name="encoder", sigmas=np.array([sigma]))
    return SimpleNamespace(
        joints=("j",),
        motor_encoder=encoder,
        layout=SimpleNamespace(motors=motors),
        parameters={name: SimpleNamespace(fixed=name in fixed) for name in parameters},
        sharpness_of=lambda name: sharpness,
        has_effect=lambda effect, owner: False,
    )


@pytest.mark.parametrize("held", [(), ("j.friction_sharpness",)])
def test_a_standstill_and_a_reversal_are_left_out_and_nothing_else(stopping, held):
    found = leaving_standstill_out(joint(parameters=held, fixed=held), stopping).sticking["j"]
    np.testing.assert_allclose(found, [(1.0, 1.5), (2.5, 2.5)], atol=0.025)


@pytest.mark.parametrize(
    "told",
    [{"sigma": 1e-2}, {"motors": ("j",)}],
    ids=lambda told: next(iter(told)),
)
def test_standstill_stays_where_it_tells_something_or_nobody_sees_it(stopping, told):
    assert leaving_standstill_out(joint(**told), stopping).sticking == {}


def test_a_joint_whose_sharpness_is_looked_for_is_left_out_where_it_cannot_be_told_from_standing(stopping):
    asked = joint(parameters=("j.friction_sharpness",), sharpness=5.0)  # 0.6 rad/s, which the motion hardly leaves
    found = leaving_standstill_out(asked, stopping).sticking["j"]
    np.testing.assert_allclose(found, [(1.0, 1.5), (2.5, 2.5)], atol=0.025)


def test_friction_is_known_beyond_what_the_encoder_shows_where_it_shows_less_than_friction_needs(stopping):
    (first, second) = leaving_standstill_out(joint(sigma=2e-4), stopping).sticking["j"]
    assert first[0] == pytest.approx(1.0, abs=0.1) and first[1] == pytest.approx(1.5, abs=0.1)
    assert second[0] == pytest.approx(2.5, abs=0.1) and second[1] == pytest.approx(2.5, abs=0.1)


def elastic(friction, inertia=1e-3, **kwargs):
    """A joint with a spring, whose motor has a friction [N m] and an inertia [kg m2]."""
    robot = joint(motors=("j",), **kwargs)
    values = {"coulomb_torque": SimpleNamespace(value=friction), "inertia": SimpleNamespace(value=inertia)}
    robot.drive_parameter = lambda name, what: values[what]
    return robot


def test_a_motor_that_stands_is_left_open_where_its_friction_is_stiff(stopping):
    h = np.full(100, PERIOD)
    found = holding_motors(elastic(0.05), stopping, h)["j"]
    np.testing.assert_allclose(found, [(1.0, 1.5), (2.5, 2.5)], atol=0.03)


def test_a_motor_whose_friction_can_be_integrated_keeps_its_law(stopping):
    h = np.full(100, PERIOD)
    assert holding_motors(elastic(1e-4), stopping, h) == {}
    assert holding_motors(elastic(0.05), stopping, 1e-3 * h) == {}


def test_a_motor_whose_sharpness_is_looked_for_keeps_its_law(stopping):
    assert holding_motors(elastic(0.05, parameters=("j.friction_sharpness",)), stopping, np.full(9, PERIOD)) == {}
