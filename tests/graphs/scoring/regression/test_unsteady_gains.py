# SPDX-License-Identifier: BSD-3-Clause
"""Drives whose constant falls have it named, with what it falls and what it is without loss; others have not."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_arm import SHARP, Arm, divided, moved

from jointscope.graphs.scoring.regression.asked_by_regression import most_plausible
from jointscope.graphs.scoring.regression.joint_regression import joint_rows
from jointscope.graphs.scoring.regression.regressed_causes import regressed_causes
from jointscope.graphs.scoring.regression.unsteady_gains import (
    BEYOND,
    COMMAND,
    FRICTION,
    SPEED,
    SPEEDS,
    TIME,
    unsteady_gains,
)
from jointscope.robots.recordings.recording import Recording

ARM, SECONDS = Arm(), 10.0
CONSTANTS = (8.0, 5.0, 2.0)  # [N m/A]
KNEE = np.array([1e3, 5.0, 1e3])  # [N m]
HOW = {"seconds": SECONDS, "encoder_rate": 250.0, "command_rate": 250.0}


def rows_of(robots, unit, **how):
    encoder, command = moved(ARM, **{**HOW, **how})
    if unit == "A":
        command = divided(command, CONSTANTS)
    return joint_rows(robots[unit], [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])


def with_all_speeds(_, u, __, data):
    return u * (1.0 - 0.015 * np.abs(data.qvel).sum())


def with_own_speed(_, u, __, data):
    return u * (1.0 - np.array([0.04, 0.0, 0.0]) * np.abs(data.qvel))


def with_command(_, u, __, ___):
    return u * (1.0 - np.array([0.0, 0.006, 0.0]) * np.abs(u))


def with_time(t, u, _, __):
    return u * (1.0 - 0.06 * t / SECONDS)


@pytest.mark.parametrize("unit", ["N m", "A"])
@pytest.mark.parametrize(
    ("drive", "form", "joints"),
    [
        (with_all_speeds, SPEEDS, ("j0", "j1", "j2")),
        (with_own_speed, SPEED, ("j0",)),
        (with_command, COMMAND, ("j1",)),
        (with_time, TIME, ("j0", "j1", "j2")),
    ],
)
def test_what_a_gain_falls_with_is_told_and_the_constant_without_loss(robots, unit, drive, form, joints):
    rows = rows_of(robots, unit, drive=drive)
    found = unsteady_gains(rows)
    assert {one.form for one in found} == {form} and tuple(one.joint for one in found) == joints
    assert most_plausible(rows, ["here"], regressed_causes(rows)).gains == found
    if unit == "A" and form != TIME:
        for one in found:
            assert one.with_it[f"{one.joint}.torque_constant"] > 1.005, "the plain one has a mean loss"
    if form == TIME:
        assert [one.lost for one in found] == pytest.approx([0.06] * 3, abs=0.01)


def with_a_knee(_, u, __, ___):
    return np.where(np.abs(u) > KNEE, np.sign(u) * (KNEE + 0.6 * (np.abs(u) - KNEE)), u)


@pytest.mark.parametrize("unit", ["N m", "A"])
def test_a_drive_that_gives_less_beyond_a_level_has_its_level_told(robots, unit):
    rows = rows_of(robots, unit, drive=with_a_knee)
    (found,) = most_plausible(rows, ["here"], regressed_causes(rows)).gains
    assert found.form == BEYOND and found.joint == "j1"
    assert found.level == pytest.approx(KNEE[1] / (CONSTANTS[1] if unit == "A" else 1.0), rel=0.03)


@pytest.mark.parametrize("seed", [2, 4])
def test_a_gain_that_falls_is_told_with_coarse_encoders(robots, seed):
    def drive(_, u, __, data):
        return u * (1.0 - 0.04 * np.abs(data.qvel))

    coarse = {"counts": 4096, "encoder_rate": 100.0, "command_rate": 100.0, "seed": seed}
    found = most_plausible(rows := rows_of(robots, "N m", drive=drive, **coarse), ["here"], regressed_causes(rows))
    assert found.causes == () and found.changed is None and found.link is None
    assert {one.form for one in found.gains} == {SPEED} and not found.late


def growing_friction(_, u, __, data):
    return u - 0.06 * np.abs(u - data.qfrc_bias) * np.tanh(SHARP * data.qvel)


def friction_that_falls(t, u, _, data):
    return u - np.array([0.6, 0.3, 0.1]) * (0.5 - t / SECONDS) * np.tanh(SHARP * data.qvel)


def dead_band(_, u, __, ___):
    return np.sign(u) * np.maximum(np.abs(u) - np.array([0.0, 0.25, 0.0]), 0.0)


def warming(t, u, _, data):
    friction = np.array(ARM.dry) * np.tanh(SHARP * data.qvel) + np.array(ARM.viscous) * data.qvel
    return u + 0.2 * t / SECONDS * friction


@pytest.mark.parametrize("unit", ["N m", "A"])
@pytest.mark.parametrize("drive", [warming, friction_that_falls])
def test_friction_that_falls_with_time_is_no_gain_that_does(robots, unit, drive):
    found = most_plausible(rows := rows_of(robots, unit, drive=drive), ["here"], regressed_causes(rows))
    assert {one.form for one in found.gains} == {FRICTION} and found.causes == () and found.changed is None
    assert {one.joint for one in found.gains} == {"j0", "j1", "j2"}
    if drive is warming:
        assert [one.lost for one in found.gains] == pytest.approx([0.2] * 3, abs=0.02)


@pytest.mark.parametrize(
    "how",
    [
        {"seed": 1},
        {"seed": 2},
        {"seed": 3, "noise": 3e-4},
        {"sticks": True},
        {"pause": 0.3},
        {"encoder_rate": 100.0, "command_rate": 100.0},
        {"counts": 8192},
        {"cable": 3.0},
        {"push": (4.0, 4.6, 1, 8.0)},
        {"drive": growing_friction},
        {"drive": dead_band},
    ],
    ids=lambda how: " ".join(f"{key} {getattr(value, '__name__', value)}" for key, value in how.items()),
)
def test_gains_that_stay_are_not_said_to_fall(robots, how):
    rows = rows_of(robots, "A", **how)
    assert most_plausible(rows, ["here"], regressed_causes(rows)).gains == ()
