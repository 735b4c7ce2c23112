# SPDX-License-Identifier: BSD-3-Clause
"""An effect that is removed leaves the file as if it had never been there, and every line of comment in its place."""

from __future__ import annotations

import pytest

from jointscope.robots.errors import EffectError
from jointscope.robots.files.effect_editing import add_effect, remove_effect
from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.files.robot_writer import robot_text
from jointscope.robots.files.yaml_comments import remove_at
from jointscope.robots.model.command_words import ready_robots
from jointscope.robots.yaml_document import dump_document, read_document

OFFSET, DRAG, MEMORY = "torque_offset@joint1", "link_viscous@joint2", "hysteresis@joint1"
EFFECTS = f"""effects:
  # mounted slightly askew
  - {OFFSET}   # since March
  # the tool that Anna mounted
  - {DRAG}   # its cable drags
  # new belt

  - {MEMORY}   # belt of 2016

# ---- calibration of May, by hand ----
"""
PARAMETERS = """  # from the scale
  joint1.torque_offset.torque: {value: 0.5, unit: N m, positive: false}   # weighed
  # from the data sheet of the cable
  joint2.link_viscous.coefficient: {value: 0.1, unit: N m s/rad, positive: false}
  # guessed
  joint1.hysteresis.torque:
    # of both belts
    value: 0.5
    unit: N m   # per belt
    positive: false
  joint1.hysteresis.deflection: {value: 0.005, unit: rad}   # guessed too

# ---- noise ----
"""
NOISE = """  effects: {hysteresis@joint1: 0.002}   # of the belt

# ---- the end ----
"""


@pytest.fixture
def robot(tmp_path):
    """Doggy with three effects and comments everywhere."""
    text = ready_robots()["doggy"].read_text(encoding="utf-8")
    text = text.replace("urdf: doggy.urdf", "urdf: ready:doggy/doggy.urdf")
    text = text.replace("\nparameters:", f"\n{EFFECTS}parameters:").replace("\n\nnoise:", f"\n{PARAMETERS}noise:")
    (tmp_path / "my.yaml").write_text(text + NOISE, encoding="utf-8")
    return load_robot(tmp_path / "my.yaml")


def written(robot) -> str:
    return robot_text(robot, robot.path.parent)


def lines_of_comment(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if line.strip().startswith("#")]


def follows(text: str, comment: str) -> str:
    """The first line with content behind a comment."""
    lines = [line.strip() for line in text.splitlines()]
    return next(line for line in lines[lines.index(comment) :] if line and not line.startswith("#"))


def without_comments(value):
    """The plain content of a document."""
    if isinstance(value, dict):
        return {key: without_comments(v) for key, v in value.items()}
    return [without_comments(v) for v in value] if isinstance(value, list) else value


@pytest.mark.parametrize(
    "gone",
    [(OFFSET,), (DRAG,), (MEMORY,), (OFFSET, MEMORY), (MEMORY, DRAG, OFFSET), (OFFSET, DRAG, MEMORY)],
    ids=lambda labels: " ".join(labels),
)
def test_every_line_of_comment_survives_in_its_order(gone, robot):
    before = written(robot)
    assert len(lines_of_comment(before)) == 16
    for label in gone:
        robot = remove_effect(robot, label)
    after = written(robot)
    assert lines_of_comment(after) == lines_of_comment(before)
    assert follows(after, "# ---- calibration of May, by hand ----").startswith("parameters:")
    assert follows(after, "# ---- noise ----") == "noise:"
    assert "\n\n\n" not in after
    (robot.path.parent / "after.yaml").write_text(after, encoding="utf-8")
    again = load_robot(robot.path.parent / "after.yaml")
    assert [here.label for here in again.effects] == [here.label for here in robot.effects]
    assert list(again.parameters) == list(robot.parameters)


def test_a_comment_stays_above_the_effect_that_it_is_about(robot):
    text = written(remove_effect(robot, OFFSET))
    assert follows(text, "# the tool that Anna mounted") == f"- {DRAG}     # its cable drags"
    assert follows(text, "# from the data sheet of the cable").startswith("joint2.link_viscous.coefficient:")
    assert "since March" not in text and "weighed" not in text
    text = written(remove_effect(robot, DRAG))
    assert follows(text, "# new belt") == f"- {MEMORY}     # belt of 2016"
    assert follows(text, "# guessed") == "joint1.hysteresis.torque:"


def test_noise_of_an_effect_that_stays_keeps_its_place_and_its_value(robot):
    text = written(remove_effect(robot, DRAG))
    assert "  effects: {hysteresis@joint1: 0.002}   # of the belt\n\n# ---- the end ----\n" in text
    text = written(remove_effect(robot, MEMORY))
    assert "  motor_velocity: [0.262, 0.262, 0.262]\n\n# ---- the end ----\n" in text


def test_the_robot_that_was_edited_is_as_before(robot):
    remove_effect(remove_effect(robot, MEMORY), OFFSET)
    assert dump_document(robot.document) == dump_document(read_document(robot.path))


def test_what_was_added_is_removed_without_a_trace():
    doggy = load_robot("doggy")
    changed = doggy
    for label in (OFFSET, MEMORY):
        changed = add_effect(changed, label)
    for label in (OFFSET, MEMORY):
        changed = remove_effect(changed, label)
    assert written(changed) == written(doggy)


def test_comments_of_an_entry_that_is_gone_do_not_come_back_with_its_name(robot):
    robot = add_effect(remove_effect(robot, OFFSET), OFFSET)
    text = written(robot)
    assert "since March" not in text and "weighed" not in text
    assert text.count("# the tool that Anna mounted") == 1


@pytest.mark.parametrize(
    ("text", "path", "left"),
    [
        ("# top\na: 1\n# of b\nb: 2\n", ("a",), "# top\n# of b\nb: 2\n"),
        ("a: 1\n# of b\nb: 2\n", ("a",), "# of b\nb: 2\n"),
        ("a: 1\n\n# of b\nb: [x, y]   # z\n\n# end\n", ("b",), "a: 1\n\n# of b\n\n# end\n"),
        ("a: 1\nb: [x, y]   # z\n\n# end\n", ("b", 1), "a: 1\nb: [x]      # z\n\n# end\n"),
        ("a: 1   # one\nb:\n- x\n# of c\nc: 2\n", ("b", 0), "a: 1   # one\n# of c\nc: 2\n"),
        (
            "a:\n  b:\n    c: 1\n\n# of e\ne: 2\n\n# of f\nf: 3\n",
            ("e",),
            "a:\n  b:\n    c: 1\n\n# of e\n\n# of f\nf: 3\n",
        ),
        ("b:   # all\n- x\n# of y\n- y\n", ("b", 0), "b:   # all\n# of y\n- y\n"),
        ("b:\n# of x\n- x   # x\n# of y\n- y\n", ("b", 0), "b:\n# of x\n# of y\n- y\n"),
        ("b:\n- x\n# of y\n- y\n", ("b", 0), "b:\n# of y\n- y\n"),
        ("b:\n- x\n- y   # y\n# the end\n", ("b", 1), "b:\n- x\n# the end\n"),
    ],
)
def test_lines_are_hung_on_what_then_stands_before_them(text, path, left, tmp_path):
    (tmp_path / "some.yaml").write_text(text, encoding="utf-8")
    document = read_document(tmp_path / "some.yaml")
    remove_at(document, *path)
    assert dump_document(document) == left
    (tmp_path / "left.yaml").write_text(left, encoding="utf-8")
    assert without_comments(read_document(tmp_path / "left.yaml")) == without_comments(document)


def test_who_removes_the_integration_error_is_told_what_adding_it_did(tmp_path):
    text = written(load_robot("doggy")).replace("integrator: simpson", "integrator: euler  ")
    (tmp_path / "my.yaml").write_text(text, encoding="utf-8")
    robot = load_robot(tmp_path / "my.yaml")
    with pytest.raises(EffectError) as error:
        remove_effect(robot, "integration_error@robot")
    assert str(error.value) == "doggy does not have the effect 'integration_error@robot'; it has none"
    with pytest.raises(EffectError) as error:
        remove_effect(add_effect(robot, "integration_error@robot"), "integration_error@robot")
    assert str(error.value) == (
        "integration_error@robot is not listed under effects of doggy: adding it only sets "
        "`model: integrator: simpson`; to go back, set the integrator in my.yaml to what it was (euler or midpoint)"
    )


def test_an_effect_that_is_not_there_is_answered_with_those_that_are(robot):
    with pytest.raises(EffectError) as error:
        remove_effect(robot, "cogging@joint2")
    assert str(error.value) == f"doggy does not have the effect 'cogging@joint2'; it has {OFFSET}, {DRAG}, {MEMORY}"


def test_the_prior_of_a_shape_is_about_the_chosen_value():
    robot = add_effect(load_robot("doggy"), "encoder_eccentricity@joint1", {"cos": 2e-4, "order": 42.092})
    order, cos = (robot.parameters[f"joint1.encoder_eccentricity.{name}"] for name in ("order", "cos"))
    assert (order.value, order.prior) == (42.092, 42.092)
    assert (cos.value, cos.prior) == (2e-4, 0.0)
