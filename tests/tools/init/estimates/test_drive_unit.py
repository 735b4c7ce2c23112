# SPDX-License-Identifier: BSD-3-Clause
"""The unit of a command by what it does to the masses of the URDF."""

from __future__ import annotations

import pytest

from jointscope.graphs.starts.drive_regression import Value
from jointscope.tools.init.estimates.drive_unit import drive_unit

JOINTS = ("hip", "knee", "foot")


def unit_of(*gains, largest=20.0, sigma=0.01, **more):
    values = [None if gain is None else Value(gain, sigma * gain) for gain in gains]
    return drive_unit(JOINTS[: len(gains)], values, largest, **more)


@pytest.mark.parametrize(
    ("gains", "largest", "unit", "said"),
    [
        ((1.0, 1.002, 0.998), 80.0, "N m", "one unit is 0.998 to 1 N m on every joint"),
        ((1.15, 0.85, 1.0), 80.0, "N m", "as that is not 1, masses or torques of hip, knee are off by as much"),
        ((0.98, 1.0, 1.01), 0.4, "N m", "on every joint"),
        ((16.4, 6.07, 0.742), 5.0, "A", "16.4 (hip), 6.07 (knee), 0.742 (foot) N m, not 1; volts look the same"),
        ((100.0, 100.2, 99.9), 5.0, "A", "torques before gears of that ratio (unit N m, scale 100)"),
        (
            (1.0, 1.0, 2.0),
            5.0,
            "N m",
            "one unit is 1 N m on hip, knee, as no current would be by chance; foot asks for 2: ",
        ),
        (
            (1.0, 1.0, 2.0),
            5.0,
            "N m",
            "masses, torques or something else that pulls there are off; if it is a current: --unit A",
        ),
        ((1.1, 1.2, 2.0), 5.0, "A", "hip, knee could be N m: if so, check the masses beyond the others"),
        ((1.0, 1.9, 2.0), 5.0, "A", "hip could be N m: if so, check the masses beyond the others"),
        ((1.0, 2.0), 0.9, "duty", "one unit makes 1 (hip), 2 (knee) N m"),
        ((243.0, 69.5, 9.2), 0.34, "duty", "volts cannot be told apart from it"),
        ((0.5,), 0.9, "duty", "one unit makes 0.5 (hip) N m"),
        ((1.2,), 0.9, "duty", "one unit makes 1.2 (hip) N m"),
        ((1.02,), 0.9, "N m", "one unit is 1.02 N m on every joint"),
        ((2.0, 2.0), 300.0, "A", "not 1; alike"),
        ((0.54, 0.63, 0.7), 40.0, "A", "or N m, if it carries a load that the URDF lacks: --unit Nm"),
        ((0.447, 0.42, 0.09), 40.0, "A", "or N m, if it carries a load that the URDF lacks: --unit Nm"),
        ((1.15, 0.85, 1.0), 80.0, "N m", "off by as much, or the base is not level"),
    ],
)
def test_constants_tell_the_unit(gains, largest, unit, said):
    found, reason = unit_of(*gains, largest=largest)
    assert found == unit and said in reason


@pytest.mark.parametrize("gains", [(0.2, 0.15, 0.09), (0.5, 1.6, 0.4)])
def test_what_no_load_explains_is_not_said_to_be_one(gains):
    assert "a load" not in unit_of(*gains)[1]


def test_a_joint_that_tells_nothing_does_not_vote():
    values = [Value(1.0, 0.01), Value(7.0, 3.0), None]
    assert drive_unit(JOINTS, values, 20.0)[0] == "N m"


def test_without_an_answer_the_size_decides_and_that_is_said():
    assert unit_of(None, None, largest=0.9)[0] == "duty"
    unit, reason = unit_of(None, None, largest=30.0)
    assert unit == "N m" and "the recording does not show how much torque it makes" in reason
    assert "volts hardly" in unit_of(None, largest=300.0)[1]


def test_masses_that_newton_metres_could_not_move_say_current():
    unit, reason = unit_of(None, largest=4.0, heavy=("hip",))
    assert unit == "A" and "N m would be too little for the masses of hip" in reason
