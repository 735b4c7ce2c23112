# SPDX-License-Identifier: BSD-3-Clause
"""A link that weighs something else than its URDF says is told with its mass; what looks like it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_arm import SHARP, Arm, divided, moved

from jointscope.graphs.scoring.regression.asked_by_regression import most_plausible
from jointscope.graphs.scoring.regression.joint_regression import joint_rows
from jointscope.graphs.scoring.regression.regressed_causes import regressed_causes
from jointscope.robots.recordings.recording import Recording

ARM, SECONDS = Arm(), 10.0
CONSTANTS = (8.0, 5.0, 2.0)  # [N m/A]
HOW = {"seconds": SECONDS, "encoder_rate": 250.0, "command_rate": 250.0}
MASSES = (3.0, 1.8, 1.08)  # [kg]


def asked(robots, unit="N m", **how):
    encoder, command = moved(ARM, **{**HOW, **how})
    if unit == "A":
        command = divided(command, CONSTANTS)
    rows = joint_rows(robots[unit], [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])
    return most_plausible(rows, ["arm.mcap"], regressed_causes(rows))


def heavier(link, factor):
    """What makes one link heavier from the start."""

    def drive(t, u, model, _):
        if t == 0.0:
            model.body_mass[link + 1] *= factor
            model.body_inertia[link + 1] *= factor
        return u

    return drive


def tool(kilograms, place):
    """What fixes a point mass to the last link from the start."""

    def drive(t, u, model, _):
        if t == 0.0:
            mass, centre = model.body_mass[-1], model.body_ipos[-1].copy()
            at, total = np.array(place), mass + kilograms
            new = (mass * centre + kilograms * at) / total
            for m, p in ((mass, centre), (kilograms, at)):
                arm = p - new
                model.body_inertia[-1] += m * (arm @ arm - arm**2)  # products of the offsets are small here
            model.body_mass[-1], model.body_ipos[-1] = total, new
        return u

    return drive


@pytest.mark.parametrize(
    ("link", "factor", "how"),
    [
        (0, 1.1, {"seed": 4}),
        (1, 1.05, {}),
        (1, 0.93, {"seed": 2}),
        (2, 1.08, {"seed": 5}),
        (2, 0.9, {"seed": 3, "noise": 1e-4}),
        (1, 1.1, {"seed": 6, "counts": 65536, "encoder_rate": 100.0, "command_rate": 100.0}),
        (1, 1.07, {"seed": 7, "sticks": True, "pause": 0.3}),
    ],
)
def test_a_link_that_is_heavier_or_lighter_has_its_mass_told(robots, link, factor, how):
    found = asked(robots, drive=heavier(link, factor), **how)
    assert found.link is not None and found.causes == () and found.gains == () and found.changed is None
    assert found.link.joint == f"j{link}" and found.link.moments == ()
    assert found.link.mass == pytest.approx((factor - 1.0) * MASSES[link], abs=max(4.0 * found.link.sigma, 0.01))
    assert found.link.share == pytest.approx(factor - 1.0, rel=0.1)


@pytest.mark.parametrize(("link", "factor"), [(1, 1.1), (2, 0.9)])
def test_masses_are_told_beside_constants_of_drives(robots, link, factor):
    found = asked(robots, "A", drive=heavier(link, factor), seed=2)
    assert found.link is not None and found.link.joint == f"j{link}"
    assert found.link.share == pytest.approx(factor - 1.0, rel=0.15)


def test_a_tool_that_the_urdf_lacks_is_mass_at_another_place(robots):
    found = asked(robots, drive=tool(0.2, (0.02, 0.01, -0.4)))
    assert found.link is not None and found.link.joint == "j2" and len(found.link.moments) == 3
    assert found.link.explained > 0.9


def test_a_base_that_is_not_level_blames_no_link(robots):
    encoder, command = moved(replace(ARM, gravity=(1.2, 0.5, -9.72)), **HOW)
    rows = joint_rows(robots["N m"], [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])
    found = most_plausible(rows, ["arm.mcap"], regressed_causes(rows))
    assert found.link is None and not found.names


def weaker(_, u, __, ___):
    return u * np.array([1.0, 0.94, 1.0])


def saturating(_, u, __, ___):
    return np.sign(u) * np.where(np.abs(u) > 6.0, 6.0 + 0.6 * (np.abs(u) - 6.0), np.abs(u))


def offset(_, u, __, ___):
    return u + np.array([0.0, 0.4, 0.0])


def slower(_, u, __, data):
    return u * (1.0 - 0.04 * np.abs(data.qvel))


def by_direction(_, u, __, data):
    return u - np.array([0.0, 0.4, 0.0]) * np.tanh(SHARP * data.qvel) ** 2


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"seed": 2},
        {"seed": 3, "noise": 3e-4},
        {"sticks": True, "pause": 0.3},
        {"counts": 4096, "encoder_rate": 100.0, "command_rate": 100.0},
        {"cable": 3.0},
        {"push": (4.0, 4.6, 1, 8.0)},
        {"drive": weaker},
        {"drive": saturating},
        {"drive": offset},
        {"drive": slower},
        {"drive": by_direction},
    ],
    ids=lambda how: " ".join(f"{key} {getattr(value, '__name__', value)}" for key, value in how.items()),
)
def test_links_that_weigh_what_they_should_are_not_blamed(robots, how):
    assert asked(robots, **how).link is None


@pytest.mark.parametrize(("joint", "offset"), [(2, 0.04), (2, -0.07), (1, 0.05), (1, -0.2)])
@pytest.mark.parametrize("unit", ["N m", "A"])
def test_an_encoder_with_another_zero_is_not_taken_for_a_mass(robots, unit, joint, offset):
    robot = robots[unit]
    encoder, command = moved(ARM, **HOW)
    encoder = replace(encoder, values=encoder.values + offset * np.eye(3)[joint])
    rows = joint_rows(robot, [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])
    link = most_plausible(rows, ["arm.mcap"], regressed_causes(rows)).link
    assert link.label == f"encoder_offset@{ARM.joints[joint]}" and not link.tilted
    assert link.turn == pytest.approx(offset, abs=0.005)  # the calibration finds its size


def test_a_tool_at_the_tip_is_not_another_zero(robots):
    link = asked(robots, drive=tool(0.5, (0.3, 0.0, 0.1))).link
    assert link.moments and not link.turn


@pytest.mark.parametrize("offsets", [(0.0, 0.06, 0.09), (0.0, -0.05, 0.12), (0.08, -0.06, 0.0)])
@pytest.mark.parametrize("unit", ["N m", "A"])
def test_several_encoders_with_another_zero_are_named_together(robots, unit, offsets):
    encoder, command = moved(ARM, **HOW)
    if unit == "A":
        command = divided(command, CONSTANTS)
    encoder = replace(encoder, values=encoder.values + np.array(offsets))
    rows = joint_rows(robots[unit], [Recording("arm.mcap", "", 0, {"encoder": encoder, "command": command})])
    link = most_plausible(rows, ["arm.mcap"], regressed_causes(rows)).link
    wrong = {joint: angle for joint, angle in zip(ARM.joints, offsets, strict=True) if angle}
    assert {label.split("@")[0] for label in link.label.split()} == {"encoder_offset"}
    assert {link.joint: link.turn} | dict(link.beside) == pytest.approx(wrong, abs=0.01)
