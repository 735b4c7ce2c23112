# SPDX-License-Identifier: BSD-3-Clause
"""Links that still swing when the next rest begins tell springs better than a coarse encoder tells where they stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lever_bench import K2, K3, K, lever
from swinging_rods import DRY, swinging_lever, swinging_pair
from two_levers import STIFFNESS, two_levers

from jointscope.graphs.rests.calibrate_rests import calibrate_rests
from jointscope.robots.rests import rests as cutting
from jointscope.robots.rests.rests import find_rests
from jointscope.robots.rests.turning_points import TurningPoints

STEP = 1.5e-3  # [rad] of the encoders on the links
SWING = 8.0 * STEP


def coarse(robot):
    sigmas = np.full(robot.n, STEP / np.sqrt(12.0))
    return robot.with_sensors({"link_angle": replace(robot.link_encoder, sigmas=sigmas)})


def both(robot, recording, loads, monkeypatch):
    """What the rests say, and what middles of swings alone add to plain means: with them, and without."""
    found = [calibrate_rests(robot, [find_rests(recording, robot, loads)])]
    with monkeypatch.context() as patch:
        patch.setattr(cutting, "turning_points", lambda *_: TurningPoints.none(1, robot.n))
        found.append(calibrate_rests(robot, [find_rests(recording, robot, loads)]))
        patch.setattr(cutting, "middle_of_swing", lambda times, readings, sigma: None)
        found.append(calibrate_rests(robot, [find_rests(recording, robot, loads)]))
    return tuple({p.name: p for p in result.parameters} for result in found)


def test_swings_of_a_lever_tell_its_hardening_spring(tmp_path, monkeypatch):
    robot = coarse(lever(tmp_path))
    recording, loads, rest = swinging_lever(40, 1, STEP, SWING)
    rests = find_rests(recording, robot, loads)
    assert len(rests) == len(rest) and np.median(rests.rounding) < 0.8
    sigma = np.hypot(rests.rounding * robot.link_encoder.sigmas, rests.link_scatter)
    assert np.sqrt(np.mean(((rests.q_link - rest) / sigma) ** 2)) < 1.2
    found, middles, plain = both(robot, recording, loads, monkeypatch)
    truth = {"swing.stiffness": K, "swing.spring_curve.quadratic": K2, "swing.spring_curve.cubic": K3}
    for name, value in truth.items():
        assert abs(found[name].value - value) < 3.0 * found[name].sigma < 1.5 * plain[name].sigma, name
        assert abs(middles[name].value - value) < 3.0 * middles[name].sigma < 1.5 * plain[name].sigma, name
    assert found["swing.stiffness"].value == pytest.approx(K, rel=2e-3)


def test_swings_of_two_rods_that_move_each_other_tell_both_springs_from_far_off(tmp_path, monkeypatch):
    robot = coarse(two_levers(tmp_path))  # its start values are 50 and 20 % off, far beyond what such encoders leave
    recording, loads, rest = swinging_pair(40, 3, STEP, SWING)
    rests = find_rests(recording, robot, loads)
    near = [int(np.argmin(np.linalg.norm(rest - q, axis=1))) for q in rests.q_link]
    sigma = np.hypot(rests.rounding * robot.link_encoder.sigmas, rests.link_scatter)
    assert np.sqrt(np.mean(((rests.q_link - rest[near]) / sigma) ** 2)) < 1.2
    found, middles, plain = both(robot, recording, loads, monkeypatch)
    truth = {"a.stiffness": STIFFNESS[0], "b.stiffness": STIFFNESS[1], "a.coulomb_torque": DRY[0]}
    truth |= {"b.coulomb_torque": DRY[1], "b.link_mass.mass": 0.2}
    for name, value in truth.items():
        assert abs(found[name].value - value) < 3.0 * found[name].sigma, name
    for joint in ("a", "b"):
        assert middles[f"{joint}.stiffness"].sigma < plain[f"{joint}.stiffness"].sigma
    assert found["b.stiffness"].value == pytest.approx(STIFFNESS[1], rel=4e-3)
