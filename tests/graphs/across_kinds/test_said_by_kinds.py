# SPDX-License-Identifier: BSD-3-Clause
"""Verdicts of several kinds put together, by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from jointscope.graphs.across_kinds.said_by_kinds import Said, across_kinds, unseen_by_arm


def said(verdict, size=1.0, sigma=0.1, alike=(), unit="N m"):
    return Said(verdict, {"torque": (size, sigma, unit)}, tuple(alike))


def verdicts(**kinds):
    return {c.label: c for c in across_kinds(kinds)}


@pytest.mark.parametrize(
    ("motion", "rests", "verdict", "against"),
    [
        (said("missing"), said("missing", 1.1), "missing", ()),
        (said("missing"), said("untestable"), "missing", ()),
        (said("missing"), said("absent", 0.9, 0.5), "missing", ()),
        (said("missing"), said("absent", 0.0), "possible", ("rests",)),
        (said("missing"), said("missing", -1.0), "possible", ("motion", "rests")),
        (said("missing", 1.0, 1e-6), said("missing", 1.2, 1e-6), "missing", ()),
        (said("missing"), said("absent", 0.0, unit="rad"), "missing", ()),
        (said("possible"), said("absent", 0.0), "absent", ("rests",)),
        (said("possible"), said("absent", 1.0), "possible", ()),
        (said("stand_in"), said("untestable"), "possible", ()),
        (said("absent"), said("untestable"), "absent", ()),
        (said("untestable"), said("untestable"), "untestable", ()),
    ],
)
def test_what_two_kinds_say_is_one_verdict(motion, rests, verdict, against):
    found = verdicts(motion={"a@j": motion}, rests={"a@j": rests})["a@j"]
    assert found.verdict == verdict and found.against == against


def test_look_alikes_stay_where_every_kind_that_shows_the_effect_has_them():
    found = verdicts(
        motion={"a@j": said("missing", alike=["b@j", "c@j"])}, poses={"a@j": said("missing", alike=["c@j", "d@j"])}
    )["a@j"]
    assert found.look_alikes == ("c@j",)
    assert found.told_apart == {"motion": ("d@j",), "poses": ("b@j",)}


def test_a_look_alike_that_another_kind_shows_explains_an_effect_that_it_could_show_and_does_not():
    rests = {"a@j": said("missing", alike=["b@j"]), "b@j": said("possible", alike=["a@j"])}
    found = verdicts(motion={"b@j": said("missing"), "a@j": said("possible")}, rests=rests)
    assert found["b@j"].verdict == "missing" and found["b@j"].explained_by == ""
    assert found["a@j"].verdict == "possible" and found["a@j"].explained_by == "b@j"
    found = verdicts(motion={"b@j": said("missing"), "a@j": said("untestable")}, rests=rests)
    assert found["a@j"].verdict == "missing"


def test_effects_that_more_kinds_show_come_first():
    one = {"a@j": said("missing"), "b@j": said("missing"), "c@j": said("absent")}
    found = across_kinds({"motion": one, "rests": {"b@j": said("missing"), "d@j": said("possible")}})
    assert [c.label for c in found] == ["b@j", "a@j", "d@j", "c@j"]


def test_effects_of_motion_that_do_nothing_in_poses_are_untestable_by_them():
    found = unseen_by_arm(["torque_delay@robot", "payload@robot", "cogging@j"], ["poses", "frequency"])
    assert set(found) == {"poses"} and set(found["poses"]) == {"torque_delay@robot"}
    assert found["poses"]["torque_delay@robot"].why == "nothing moves at rest"


def test_steps_from_a_model_that_explains_little_speak_against_nothing():
    by_kind = {
        "motion": {"payload@robot": Said("missing", {"mass": (0.3, 1e-3, "kg")})},
        "frequency": {"payload@robot": Said("possible", {"mass": (0.03, 1e-3, "kg")}, sure=False)},
    }
    (found,) = across_kinds(by_kind)
    assert found.verdict == "missing" and found.against == ()
    by_kind["frequency"]["payload@robot"] = replace(by_kind["frequency"]["payload@robot"], sure=True)
    (found,) = across_kinds(by_kind)
    assert found.verdict == "possible" and found.against == ("frequency",)


def test_what_such_a_model_shows_is_no_objection_but_others_speak_against_it():
    unsure = Said("missing", {"share": (0.008, 1e-3, "1")}, sure=False)
    motion = Said("absent", {"share": (0.0, 1e-5, "1")})
    (found,) = across_kinds(
        {"motion": {"torque_constant_error@j": motion}, "frequency": {"torque_constant_error@j": unsure}}
    )
    assert found.verdict == "possible" and found.against == ("motion",)


def test_of_two_effects_that_explain_each_other_the_one_with_more_evidence_is_missing():
    sizes = {"mass": (0.3, 1e-3, "kg")}
    payload = {
        "motion": Said("missing", sizes, ("link_mass@j",), evidence=90.0),
        "rests": Said("missing", sizes, ("link_mass@j",), evidence=50.0),
        "frequency": Said("possible", {}, ("link_mass@j",)),
    }
    mass = {
        "motion": Said("missing", {"mass": (0.7, 1e-3, "kg")}, ("payload@robot",), evidence=80.0),
        "rests": Said("possible", {}, ("payload@robot",)),
        "frequency": Said("missing", {"mass": (0.7, 1e-2, "kg")}, ("payload@robot",), evidence=10.0),
    }
    kinds = {k: {"payload@robot": payload[k], "link_mass@j": mass[k]} for k in payload}
    found = {c.label: c for c in across_kinds(kinds)}
    assert found["payload@robot"].explained_by == "" and found["payload@robot"].verdict == "missing"
    assert found["link_mass@j"].explained_by == "payload@robot"
