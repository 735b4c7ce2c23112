# SPDX-License-Identifier: BSD-3-Clause
"""Motors that links shook towards the middle of their bands: what friction held at the turning points tells the band.

The recordings have stick and slip of their own (stopping_motor.py) and share no formula with the estimator.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import lever
from stopping_motor import STEPS, STIFFNESS, visited

from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.rests.load_history import LoadHistory
from jointscope.robots.rests.rests import find_rests
from jointscope.robots.rests.turning_points import farthest_turns
from jointscope.tools.verdicts.rests.rest_verdict import verdict

FRICTION = 0.6


def postures(seed):
    return np.random.default_rng(seed).uniform(-1.3, 1.3, 30)


def straight(folder):
    """The lever with a straight spring and dry friction alone."""
    path = lever(folder).path
    text = path.read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if "spring_curve" not in line and "weight_dependent" not in line]
    path.write_text("\n".join(kept) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("seed", (1, 2, 3))
def test_friction_is_right_where_links_shook_motors_to_the_middle_of_its_band(tmp_path, seed):
    robot = load_robot(straight(tmp_path))
    rests = find_rests(visited(postures(seed), FRICTION, seed), robot, LoadHistory.none())
    result = calibrate_rests(robot, [rests])
    found = {p.name: p for p in result.parameters}
    friction, stiffness = found["swing.coulomb_torque"], found["swing.stiffness"]
    assert abs(friction.value - FRICTION) < 3.0 * friction.sigma < 0.4 * FRICTION
    assert friction.value == pytest.approx(FRICTION, rel=0.05)
    assert abs(stiffness.value - STIFFNESS) < 3.0 * stiffness.sigma
    assert verdict(result).startswith("Yes")
    # at rest friction holds far less than all that it can: without the swings the band would end there
    plain = calibrate_rests(robot, [replace(rests, turning_points=None)])
    (narrow,) = (p for p in plain.parameters if p.name == "swing.coulomb_torque")
    assert narrow.value < 0.9 * FRICTION


def test_turning_points_of_a_swing_are_those_of_a_parabola_through_its_readings():
    t = np.arange(600) / 200.0
    swing = 0.01 * np.exp(-0.8 * t) * np.cos(9.0 * t + 1.0)
    readings = 0.3 + swing + STEPS[1] * np.random.default_rng(1).normal(size=len(t))
    readings[40] += 0.2  # one reading far off is no turning point
    above, below = farthest_turns(t, readings, 0.3, STEPS[1])
    assert above is not None and below is not None
    first = swing[np.argmin(swing)], np.max(swing[np.argmin(swing) :])
    assert below.deflection == pytest.approx(first[0], abs=3.0 * below.sigma) and below.sigma < 0.5 * STEPS[1]
    assert above.deflection == pytest.approx(first[1], abs=3.0 * above.sigma)
    period = 2.0 * np.pi / 9.0
    assert below.period == pytest.approx(period, rel=0.05)
    assert below.fall == pytest.approx(abs(first[0]) * np.expm1(0.8 * period), rel=0.15)


def test_what_stands_has_no_turning_points():
    t = np.arange(600) / 200.0
    noise = STEPS[1] * np.random.default_rng(2).normal(size=len(t))
    assert farthest_turns(t, 0.3 + noise, 0.3, STEPS[1]) == (None, None)
    assert farthest_turns(t, 0.3 + noise + 1e-3 * t, 0.3015, STEPS[1]) == (None, None)
