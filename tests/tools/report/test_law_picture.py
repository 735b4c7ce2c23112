# SPDX-License-Identifier: BSD-3-Clause
"""Laws of torques are drawn, with three sizes each; what is no torque of one joint's motion is not."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from jointscope.robots.effect_kinds.joint_torque import JointTorque
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.tools.report.law_picture import law_picture

EFFECTS = catalogue()
TORQUES = [id for id, effect in EFFECTS.items() if isinstance(effect, JointTorque)]
SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("id", TORQUES)
def test_a_law_has_a_curve_for_each_size_and_way(id):
    root = ElementTree.fromstring(law_picture(EFFECTS[id]))
    curves = [path.get("data-name") for path in root.iter(f"{SVG}path") if path.get("data-name")]
    ways = ("", ", backwards", ", forwards") if "load" in root.find(f".//{SVG}text[@class='xlabel']").text else ("",)
    expected = {f"{size}{way}" for size in ("half", "the example", "twice") for way in (ways[1:] or ways)}
    assert set(curves) == expected


def test_what_is_no_torque_is_not_drawn():
    assert all(law_picture(effect) is None for id, effect in EFFECTS.items() if id not in TORQUES)


def test_backlash_takes_as_much_torque_as_the_spring_bends_within_the_gap():
    text = law_picture(EFFECTS["backlash"])
    labels = [t.text for t in ElementTree.fromstring(text).iter(f"{SVG}text") if t.get("class") == "y"]
    # 150 N m/rad times twice 0.01 rad
    assert "2" in labels and "4" not in labels
