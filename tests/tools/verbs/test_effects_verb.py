# SPDX-License-Identifier: BSD-3-Clause
"""`jointscope effects`: the list, a card, and both for machines."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from jointscope.robots.files import effect_catalogue
from jointscope.robots.files.effect_catalogue import catalogue
from jointscope.tools.command_line import main


@pytest.fixture(autouse=True)
def in_own_folder(tmp_path, monkeypatch):
    """An empty folder; effects of a file are forgotten afterwards."""
    monkeypatch.setattr(effect_catalogue, "_of_files", {})
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(capsys, *arguments: str) -> str:
    assert main(["effects", *arguments]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return out


def test_the_list_names_every_effect_with_its_owner_and_where_it_is_absent(capsys):
    lines = said(capsys).splitlines()
    for effect in catalogue().values():
        ((k, line),) = [(k, line) for k, line in enumerate(lines) if line.split()[:1] == [effect.id]]
        assert effect.card.title in line
        owners = line + (lines[k + 1] if lines[k + 1].startswith("     ") else "")
        assert all(owner in owners for owner in effect.owners)
    assert max(map(len, lines)) <= 120


@pytest.mark.parametrize("effect_id", list(catalogue()))
def test_a_card_says_everything(effect_id, capsys):
    effect = catalogue()[effect_id]
    text = said(capsys, effect_id)
    words = " ".join(text.split())
    for part in (effect.card.law, effect.card.explanation, effect.card.source, effect.card.excitation):
        assert " ".join(part.split()) in words
    for name, reason in effect.card.look_alikes.items():
        assert f"{name}: {reason}" in words
    for p in effect.parameters:
        assert p.name in text and p.unit in text
    assert max(map(len, text.splitlines())) <= 120


def test_json_says_what_the_screen_says(in_own_folder, capsys):
    said(capsys, "cogging", "--json", "card.json")
    card = json.loads((in_own_folder / "card.json").read_text())
    assert card["parameters"]["cos"]["null"] == 0.0
    assert card["parameters"]["order"]["null"] is None
    said(capsys, "--json", "all.json")
    assert list(json.loads((in_own_folder / "all.json").read_text())["effects"]) == list(catalogue())


def test_an_effect_of_the_users_own_is_listed_and_has_a_card(in_own_folder, capsys):
    text = "from dataclasses import replace\nfrom jointscope.robots.effects.cogging import EFFECT as OTHER\n"
    (in_own_folder / "mine.py").write_text(text + "EFFECT = replace(OTHER, id='my_cogging')\n")
    assert "my_cogging" in said(capsys, "--effects", "mine.py")
    assert said(capsys, "my_cogging", "--effects", "mine.py").startswith("my_cogging: torque ripple")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["coging"], "no effect 'coging'; did you mean 'cogging'?"),
        (["--effects", "none.py"], "cannot read the effects file none.py: No such file or directory"),
        (["--json", "no/folder.json"], None),
    ],
)
def test_mistakes_are_answered_in_one_line(arguments, message, capsys):
    assert main(["effects", *arguments]) == 1
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    if message:
        assert err == f"jointscope: error: {message}\n"


def test_the_page_of_the_catalogue_is_current(capsys, in_own_folder):
    said(capsys, "--page", "catalogue.md")
    page = (in_own_folder / "catalogue.md").read_text(encoding="utf-8")
    kept = (Path(__file__).parents[3] / "docs" / "catalogue.md").read_text(encoding="utf-8")
    assert page == kept, "write it anew: jointscope effects --page docs/catalogue.md"
    drawn = {path.name: path.read_text(encoding="utf-8") for path in (in_own_folder / "pictures" / "effects").iterdir()}
    there = (Path(__file__).parents[3] / "docs" / "pictures" / "effects").iterdir()
    stands = {path.name: path.read_text(encoding="utf-8") for path in there}
    assert stands.keys() == drawn.keys()
    for name, text in drawn.items():
        assert alike(text, stands[name]), (
            f"{name} is another; write it anew: jointscope effects --page docs/catalogue.md"
        )
    assert {f"pictures/effects/{name}" for name in drawn} == set(re.findall(r"\]\((pictures/[^)]+)\)", page))


def alike(one: str, other: str) -> bool:
    """Whether two drawings differ by less than a pixel: their last digits are those of a machine's linear algebra."""
    path = re.compile(r' d="([^"]*)"')
    if path.sub("", one) != path.sub("", other):
        return False
    return all(curves_alike(a, b) for a, b in zip(path.findall(one), path.findall(other), strict=True))


def curves_alike(one: str, other: str) -> bool:
    """Two paths of straight lines in steps of tenths of a pixel, or the same text."""
    if one == other:
        return True
    a, b = (np.cumsum(np.array(re.findall(r"-?\d+", d), float).reshape(-1, 2), axis=0) for d in (one, other))
    at = np.linspace(a[0, 0], a[-1, 0], 200)
    return bool(np.mean(np.abs(np.interp(at, a[:, 0], a[:, 1]) - np.interp(at, b[:, 0], b[:, 1]))) < 10.0)


def test_the_page_has_every_effect_with_its_law_and_links_that_lead_somewhere(capsys, in_own_folder):
    said(capsys, "--page", "catalogue.md")
    page = (in_own_folder / "catalogue.md").read_text(encoding="utf-8")
    headings = set(re.findall(r"^### (\S+)$", page, re.MULTILINE))
    assert headings == set(catalogue())
    assert set(re.findall(r"\]\(#([^)]+)\)", page)) == headings
    assert all(effect.card.law in page for effect in catalogue().values())
