# SPDX-License-Identifier: BSD-3-Clause
"""Signatures of effects: there is one for each, in the equation or channel that the effect touches, of its shape."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.tools.report import signature_picture as module
from jointscope.tools.report.signature_picture import signature_picture

EFFECTS = catalogue()
SVG = "{http://www.w3.org/2000/svg}"
TOUCHED = {
    "motor_viscous": "acceleration that the motor of joint2 lacks [rad/s^2]",
    "link_coulomb": "acceleration that the link of joint2 lacks [rad/s^2]",
    "encoder_scale": "error of joint2.motor_position [rad]",
    "gyro_bias_drift": "error of imu2.x [rad/s]",
}


def drawn(effect_id: str) -> ElementTree.Element:
    svg = signature_picture(EFFECTS[effect_id])
    assert svg is not None
    return ElementTree.fromstring(svg)


def curves(root: ElementTree.Element) -> list[np.ndarray]:
    """Points of the speed and of what is lacking, in tenths of a pixel from the top left; paths hold steps."""
    paths = [path.get("d") for path in root.iter(f"{SVG}path") if path.get("data-name") in ("speed", "lacks")]
    assert all(d.count("M") == 1 for d in paths)
    return [np.cumsum(np.array(re.findall(r"-?\d+", d), float).reshape(-1, 2), axis=0) for d in paths]


@pytest.mark.parametrize("effect_id", [id for id in EFFECTS if id != "load_scale"])  # that one moves nothing
def test_every_effect_has_a_signature_with_the_motion_above_it(effect_id):
    root = drawn(effect_id)
    titles = [text.text for text in root.iter(f"{SVG}text")]
    assert titles[0].startswith(f"{effect_id}@")
    assert any(text and text.startswith("speed of ") for text in titles)
    found = curves(root)
    assert 2 <= len(found) <= 1 + module.MOST_ROWS
    assert all(len(points) > 100 or np.ptp(points[:, 1]) == 0.0 for points in found)


@pytest.mark.parametrize(("effect_id", "row"), TOUCHED.items())
def test_a_signature_stands_in_the_equation_or_channel_that_the_effect_touches(effect_id, row):
    titles = [text.text for text in drawn(effect_id).iter(f"{SVG}text")]
    assert row in titles


def test_viscous_friction_is_lacking_against_the_speed():
    speed, lacks = curves(drawn("link_viscous"))
    at = np.linspace(500.0, 5000.0, 200)
    y = [np.interp(at, points[:, 0], points[:, 1]) for points in (speed, lacks)]
    assert np.corrcoef(y[0], y[1])[0, 1] < -0.99


def test_a_bias_that_drifts_is_a_straight_line():
    _, lacks, *_ = curves(drawn("gyro_bias_drift"))
    line = np.polyfit(lacks[:, 0], lacks[:, 1], 1)
    assert np.max(np.abs(lacks[:, 1] - np.polyval(line, lacks[:, 0]))) < 0.01 * np.ptp(lacks[:, 1])


def test_an_effect_of_no_ready_robot_is_not_drawn(monkeypatch):
    monkeypatch.setattr(module, "ROBOTS", ("doggy",))
    assert signature_picture(EFFECTS["torque_constant_error"]) is None
