# SPDX-License-Identifier: BSD-3-Clause
"""Effects of a user's file or of an installed package are found and checked; mistakes are named with their place."""

from __future__ import annotations

import re
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from jointscope.robots.errors import EffectError
from jointscope.robots.files import effect_catalogue
from jointscope.robots.files.effect_catalogue import add_user_effects, catalogue, parse_effect
from jointscope.robots.files.robot_file import load_robot

DOGGY = load_robot("doggy")
TUTORIAL = Path(__file__).resolve().parents[3] / "docs" / "your_own_effect.md"
OWN_EFFECT = """from jointscope.robots.effect_kinds.effect import Card, EffectParameter
from jointscope.robots.effect_kinds.joint_torque import JointTorque

CARD = Card(title="drag", law="-d v^2", explanation="air", source="none", typical="1", excitation="fast motion")
SIZE = EffectParameter("size", "N m", 1.0, 10.0)


def law(s, p):
    return -p["size"] * s.v_link * s.v_link


EFFECT = JointTorque(id="drag", side="link", law=law, parameters=(SIZE,), card=CARD)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to work in; what is added to the catalogue is gone afterwards."""
    monkeypatch.setattr(effect_catalogue, "_of_files", {})
    monkeypatch.chdir(tmp_path)
    return tmp_path


def complaint(text: str | bytes) -> str:
    """What is said about a file with this content."""
    data = text.encode() if isinstance(text, str) else text
    Path("my_effects.py").write_bytes(data)
    with pytest.raises(EffectError) as err:
        add_user_effects("my_effects.py")
    assert "\n" not in str(err.value)
    return str(err.value)


def changed(old: str, new: str) -> str:
    assert old in OWN_EFFECT
    return OWN_EFFECT.replace(old, new)


def test_an_effect_in_a_file_stands_in_the_catalogue(folder):
    (folder / "my_effects.py").write_text(OWN_EFFECT)
    (effect,) = add_user_effects("my_effects.py")
    assert catalogue()["drag"] is effect
    assert parse_effect("drag@joint2", DOGGY) == (effect, "joint2")


def test_adding_a_file_again_takes_what_it_holds_now(folder):
    (folder / "my_effects.py").write_text(OWN_EFFECT)
    add_user_effects("my_effects.py")
    (folder / "my_effects.py").write_text(changed('id="drag"', 'id="air_drag"'))
    add_user_effects(folder / "my_effects.py")
    assert "air_drag" in catalogue()
    assert "drag" not in catalogue()


def test_a_file_may_hold_several_effects_and_import_others(folder):
    more = "import dataclasses\nfrom jointscope.robots.effects.cogging import EFFECT as COGGING\n"
    more += OWN_EFFECT + 'SECOND = dataclasses.replace(EFFECT, id="second")\nALIAS = SECOND\n'
    (folder / "two.py").write_text(more)
    assert [effect.id for effect in add_user_effects("two.py")] == ["drag", "second"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("x = 1\ndef law(:\n", "my_effects.py, line 2: not Python: invalid syntax; correct the file"),
        (
            "x = 1\nimport nowhere\n",
            "my_effects.py, line 2: ModuleNotFoundError: No module named 'nowhere'; correct the file",
        ),
        ("import sys\n\nsys.exit(3)\n", "my_effects.py, line 3: SystemExit: 3; correct the file"),
        (
            "x = 1\n",
            "my_effects.py: no effect in it; expected a constant at the top level such as EFFECT = JointTorque(...)",
        ),
        (b"\xff\xfe\x00", "my_effects.py is not a Python file: it is not text; --effects takes a .py file"),
        (
            changed('id="drag"', 'id="cogging"'),
            "my_effects.py, line 12: the id 'cogging' is taken by another effect; give this one another id",
        ),
        (
            changed('id="drag"', 'id="Air drag"'),
            "my_effects.py, line 12: id: expected lower-case letters, digits and _, got 'Air drag'",
        ),
        (
            changed('side="link"', 'side="left"'),
            "my_effects.py, line 12: drag: side: expected one of motor, link, spring, got 'left'",
        ),
        (
            changed("card=CARD", 'card=CARD, owners=("wheel",)'),
            "my_effects.py, line 12: drag: owners: expected some of joint, joint_link, gyro, link_encoder, target, "
            "robot, got ('wheel',)",
        ),
        (
            changed("(SIZE,)", "(SIZE, SIZE)"),
            "my_effects.py, line 12: drag: parameters: expected different names, got size, size",
        ),
        (
            changed('"N m", 1.0, 10.0', '"", 1.0, 10.0'),
            "my_effects.py, line 12: drag: parameter 'size': unit: expected a text such as 'N m', or '1' for a pure "
            "number",
        ),
        (
            changed("1.0, 10.0", "0.0, 10.0, logarithmic=True"),
            "my_effects.py, line 12: drag: parameter 'size': a logarithmic parameter starts above zero, got 0",
        ),
        (
            changed("1.0, 10.0", "1.0, 0.0"),
            "my_effects.py, line 12: drag: parameter 'size': expected finite numbers and a prior_sigma above zero",
        ),
        (
            changed("1.0, 10.0", '1.0, 10.0, sign="-"'),
            "my_effects.py, line 12: drag: parameter 'size': sign: expected '+' or '+-', got '-'",
        ),
        (
            changed("card=CARD", 'card=CARD, example={"length": 1.0}'),
            "my_effects.py, line 12: drag: example: no parameter 'length'; it has size",
        ),
        (
            changed('-p["size"]', '1.0 - p["size"]'),
            "my_effects.py, line 12: drag: law: expected no torque at the null values, got 1 N m",
        ),
        (
            changed('p["size"]', 'p["length"]'),
            "my_effects.py, line 12: drag: law: KeyError: 'length'; it gets signals and a mapping",
        ),
        (
            changed("s.v_link * s.v_link", "abs(s.v_link)"),
            "my_effects.py, line 12: drag: law: its derivative by v_link is lost in complex numbers; use smooth_abs, "
            "smooth_sign and np functions instead of abs, sign and comparisons",
        ),
        (
            changed("s.v_link * s.v_link", "s.v_link[:2]"),
            "my_effects.py, line 12: drag: law: expected finite numbers of shape (6,), got shape (2,)",
        ),
    ],
)
def test_a_broken_file_is_answered_with_its_place(folder, content, message):
    assert complaint(content) == message


def test_a_file_that_is_not_there_is_named(folder):
    with pytest.raises(EffectError) as err:
        add_user_effects("nowhere.py")
    assert str(err.value) == "cannot read the effects file nowhere.py: No such file or directory"


def test_an_installed_package_may_offer_effects(folder):
    (folder / "package_with_drag.py").write_text(OWN_EFFECT)
    point = EntryPoint("drag", "package_with_drag:EFFECT", effect_catalogue.ENTRY_POINTS)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        assert list(effect_catalogue._loaded([point])) == ["drag"]
        with pytest.raises(EffectError) as err:
            effect_catalogue._loaded([point, point])
        assert str(err.value) == (
            "entry point 'drag' (package_with_drag:EFFECT): the id 'drag' is taken by another effect; uninstall one of "
            "the two"
        )
        with pytest.raises(EffectError) as err:
            effect_catalogue._loaded([replace_value(point, "package_with_drag:CARD")])
    assert str(err.value) == "entry point 'drag' (package_with_drag:CARD): expected an effect, got Card"
    with pytest.raises(EffectError) as err:
        effect_catalogue._loaded([replace_value(point, "nowhere_at_all:EFFECT")])
    assert str(err.value) == (
        "entry point 'drag' (nowhere_at_all:EFFECT): ModuleNotFoundError: No module named 'nowhere_at_all'; repair or "
        "uninstall that package"
    )


def replace_value(point: EntryPoint, value: str) -> EntryPoint:
    return EntryPoint(point.name, value, point.group)


def test_the_effect_of_the_tutorial_works(folder):
    blocks = re.findall(r"```python\n(.*?)```", TUTORIAL.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 1
    (folder / "my_effects.py").write_text(blocks[0])
    (effect,) = add_user_effects("my_effects.py")
    assert f"{effect.id}@joint1" in TUTORIAL.read_text(encoding="utf-8")
    assert parse_effect(f"{effect.id}@joint1", DOGGY) == (effect, "joint1")
    assert set(effect.card.look_alikes) <= set(catalogue())
