# SPDX-License-Identifier: BSD-3-Clause
"""Effects of one spring that contradict each other are told in one line when a robot file is read."""

from __future__ import annotations

import pytest

from jointscope.robots.errors import EffectError, RobotError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.model.robot import Robot

DOGGY = load_robot("doggy")


def saved(robot: Robot, folder) -> None:
    (folder / "arm.yaml").write_text(robot_text(robot, folder), encoding="utf-8")


def reloaded(robot: Robot, folder) -> Robot:
    saved(robot, folder)
    return load_robot(folder / "arm.yaml")


def with_effects(*effects: tuple[str, dict[str, float]]) -> Robot:
    robot = DOGGY
    for label, sizes in effects:
        robot = add_effect(robot, label, sizes)
    return robot


WRONG = {
    "string within slack": (
        (("spring_slack@joint1", {"forward": 0.05, "backward": 0.001}), ("spring_limit@joint1", {"forward": 0.03})),
        "arm.yaml: parameters.joint1.spring_limit.forward: expected more than the slack of spring_slack@joint1 on that "
        "side, 0.05 rad, got 0.03: the string would be taut while the rope hangs slack; correct one of the two",
    ),
    "string within play": (
        (("backlash@joint2", {"half_gap": 0.04}), ("spring_limit@joint2", {"forward": 0.05, "backward": 0.02})),
        "arm.yaml: parameters.joint2.spring_limit.backward: expected more than the slack of backlash@joint2 on that "
        "side, 0.04 rad, got 0.02: the string would be taut while the rope hangs slack; correct one of the two",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_string_is_longer_than_the_slack_of_its_rope(name, tmp_path):
    effects, message = WRONG[name]
    with pytest.raises(RobotError) as error:
        reloaded(with_effects(*effects), tmp_path)
    assert str(error.value) == message


def test_slack_is_less_than_the_travel_of_the_motor(tmp_path):
    arm = add_effect(load_robot("biorob"), "spring_slack@joint1", {"forward": 40.0, "backward": 300.0})
    with pytest.raises(RobotError) as error:
        reloaded(arm, tmp_path)
    assert str(error.value).startswith(
        "arm.yaml: parameters of spring_slack@joint1: a slack of 340 rad is as wide as all that the motor turns its "
    )
    assert str(error.value).endswith("expected less: its spring would never be stretched; is it in degrees?")


@pytest.mark.parametrize("value", ["-0.03", "0.0"])
def test_knots_are_away_from_zero_and_so_in_order(tmp_path, value):
    path = tmp_path / "arm.yaml"
    saved(with_effects(("spring_pieces_2@joint1", {"forward": 0.0517, "backward": 0.04})), tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("value: 0.0517", f"value: {value}, positive: false"), encoding="utf-8")
    with pytest.raises(RobotError) as error:
        load_robot(path)
    assert str(error.value) == (
        "arm.yaml: parameters.joint1.spring_pieces_2.forward: expected a deflection above zero, from which the knots "
        f"of that side follow in order, got {float(value):g}; write how far the spring is deflected to that side"
    )


@pytest.mark.parametrize("other", ["spring_curve", "spring_cubic", "spring_pieces_4"])
def test_a_spring_has_one_curve(other, tmp_path):
    robot = with_effects(("spring_pieces_2@joint1", {}), ("spring_pieces_2@joint2", {}))
    message = "spring_pieces_2@joint1 is the curve of its spring already; remove that first"
    with pytest.raises(EffectError) as error:
        add_effect(robot, f"{other}@joint1")
    assert str(error.value) == f"{other}@joint1 cannot be added to {robot.name}: {message}"
    saved(with_effects((f"{other}@joint1", {})), tmp_path)
    text = (tmp_path / "arm.yaml").read_text(encoding="utf-8")
    both = text.replace(f"- {other}@joint1", f"- {other}@joint1\n- spring_pieces_2@joint1")
    assert both != text
    (tmp_path / "arm.yaml").write_text(both, encoding="utf-8")
    with pytest.raises(RobotError) as twice:
        load_robot(tmp_path / "arm.yaml")
    assert str(twice.value) == f"arm.yaml: effects: {other}@joint1: {message}"


def test_a_string_slack_and_a_curve_go_together_and_come_back_from_a_file(tmp_path):
    robot = with_effects(
        ("spring_slack@joint1", {"forward": 0.01, "backward": 0.001}),
        ("spring_pieces_2@joint1", {"forward": 0.03, "backward": 0.04, "forward_2": 2.0}),
        ("spring_limit@joint1", {"forward": 0.05, "backward": 0.05, "stiffness": 900.0}),
    )
    again = reloaded(robot, tmp_path)
    assert again.values == pytest.approx(robot.values)
    assert again.parameters["joint1.spring_pieces_2.forward"].fixed
