# SPDX-License-Identifier: BSD-3-Clause
"""Estimations that fail name what looked odd in their recordings."""

from __future__ import annotations

from importlib import import_module
from types import SimpleNamespace

import pytest

from jointscope.graphs.calibration import failures_with_notices
from jointscope.graphs.calibration.failures_with_notices import names_notices, next_commands, with_notices
from jointscope.graphs.discovery.diagnose import diagnose
from jointscope.graphs.discovery.discover import discover
from jointscope.robots.errors import SolveError
from jointscope.robots.files.effect_editing import add_effect
from jointscope.robots.recordings.recording import Notice, Recording

diagnose_module = import_module("jointscope.graphs.discovery.diagnose")
SWAPPED = Notice("imu2", "axes", 0, "imu2: the axes seem swapped")
GAP = Notice("command", "gap", 1, "command: one gap")
CALM = Notice("command", "info", 1, "command: nothing to worry about")


def recording(*notices):
    return Recording("run.mcap", "", 0, {}, list(notices))


def test_a_failure_names_what_the_reader_and_the_screening_saw():
    text = with_notices("it ran away", [recording(GAP, CALM)], [SWAPPED])
    assert text == "it ran away; imu2: the axes seem swapped; command: one gap"


def test_nothing_is_named_twice():
    once = with_notices("it ran away", [recording()], [SWAPPED])
    assert with_notices(once, [recording()], [SWAPPED]) == once


@pytest.mark.parametrize("depth", [1, 2])
def test_what_fails_inside_is_named_once_with_the_commands_that_look_for_the_reason(monkeypatch, depth, doggy):
    monkeypatch.setattr(failures_with_notices, "screen_all", lambda recording, robot: [SWAPPED])

    def fails(robot, recordings):
        raise SolveError("it ran away")

    for _ in range(depth):
        fails = names_notices(fails)
    with pytest.raises(SolveError) as err:
        fails(add_effect(doggy, "backlash@joint2"), [recording()])
    assert str(err.value) == (
        "it ran away; imu2: the axes seem swapped; `jointscope info run.mcap --robot doggy` says whether they fit each "
        "other, `jointscope remove doggy backlash@joint2 -o doggy_without.yaml` takes out the effect that was added "
        "last"
    )


def test_a_robot_without_effects_gets_start_values_from_init(doggy):
    text = next_commands("it ran away", doggy, [recording()])
    assert text.endswith(f"`jointscope init {doggy.tree.urdf} run.mcap -o doggy_anew.yaml` finds start values")
    assert next_commands("try `jointscope add`", doggy, [recording()]) == "try `jointscope add`"


@pytest.mark.parametrize("kind", ["gravity", "torque"])
def test_no_effect_is_blamed_beside_a_sensor_that_is_plainly_wrong(monkeypatch, doggy, kind):
    wrong = Notice("load", kind, 0, "load: write `scale: [-1, -1, -1]`")
    monkeypatch.setattr(failures_with_notices, "screen_all", lambda recording, robot: [wrong])

    @names_notices
    def fails(robot, recordings):
        raise SolveError("it ran away")

    with pytest.raises(SolveError) as error:
        fails(add_effect(doggy, "motor_stribeck@joint1"), [recording()])
    assert str(error.value) == "it ran away; load: write `scale: [-1, -1, -1]`; mend that first"


@pytest.mark.parametrize("verb", [diagnose, discover])
def test_verbs_that_learn_name_what_looked_odd(monkeypatch, verb, doggy):
    monkeypatch.setattr(failures_with_notices, "screen_all", lambda recording, robot: [SWAPPED])
    monkeypatch.setattr("jointscope.graphs.discovery.starting_model.screen_all", lambda recording, robot: [SWAPPED])
    place = {"diagnose": "jointscope.graphs.discovery.diagnose", "discover": "jointscope.graphs.discovery.search_kind"}[
        verb.__name__
    ]

    def no_base(*args, **kwargs):
        raise SolveError("it ran away")

    monkeypatch.setattr(f"{place}.BaseModel.of", no_base)
    with pytest.raises(SolveError, match="it ran away; imu2: the axes seem swapped"):
        verb(doggy, [recording()])


def test_the_robot_is_screened_as_it_was_before_its_calibration(monkeypatch):
    """A mounting that was calibrated with swapped axes fits them, and no longer looks odd."""
    monkeypatch.setattr(diagnose_module, "screen_all", lambda recording, robot: [SWAPPED] if robot == "before" else [])
    result = SimpleNamespace(start="before", bags=[SimpleNamespace(isolated=())])
    base = SimpleNamespace(recordings=[recording()], robot="after", result=result)
    assert diagnose_module._to_look_at_first(base) == [f"{diagnose_module.LOOK_FIRST}: {SWAPPED.text}."]
