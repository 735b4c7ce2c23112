# SPDX-License-Identifier: BSD-3-Clause
"""Rests that are given as motion: known loads are refused with the command that takes them, many pauses are told."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.descriptions.describe_bag import describe_bag
from jointscope.tools.bags.read_motion import read_motion
from jointscope.tools.verb_parts.first_look import first_look

ROBOT = load_robot("biorob")
DATA = Path(__file__).resolve().parents[4] / "shared" / "data" / "biorob"
needs_biorob = pytest.mark.skipif(not DATA.is_dir(), reason="shared/data/biorob is not beside the project")


@needs_biorob
def test_weights_that_hang_on_the_arm_are_no_motion():
    bag = DATA / "static_spring" / "spring1"
    with pytest.raises(RecordingError) as err:
        read_motion(bag, ROBOT)
    said = str(err.value)
    assert said.startswith(f"{bag}: loads of up to ") and " N hang on the arm (/load); expected motion" in said
    assert f"jointscope calibrate biorob --rests {bag} -o biorob_calibrated.yaml" in said and "\n" not in said


@needs_biorob
def test_a_tour_of_postures_is_motion_with_a_word_about_rests():
    recording = read_motion(DATA / "static_gravity" / "gravity", ROBOT)
    (told,) = (notice.text for notice in recording.notices if "--rests" in notice.text)
    assert told.startswith("the motors stand 28 % of the time, in 36 places; ")


@needs_biorob
def test_motion_is_read_without_a_word_about_rests():
    recording = read_motion(DATA / "clean" / "train", ROBOT)
    assert not any("--rests" in notice.text for notice in recording.notices)


@needs_biorob
@pytest.mark.parametrize(("bag", "count"), (("static_spring/spring1", 19), ("static_gravity/gravity", 46)))
def test_a_description_says_that_a_recording_is_one_of_rests_and_how_many(bag, count):
    described = describe_bag(DATA / bag, ROBOT)
    assert described.usable and described.rests == count and described.to_json()["rests"] == count
    assert described.text().endswith(f"The recording can be used for biorob as one of rests (--rests): {count} rests.")
    assert not any("limit" in notice for notice in described.notices)


@needs_biorob
def test_a_description_names_the_frame_of_a_load_that_the_robot_lacks(tmp_path):
    text = ROBOT.tree.urdf.read_text(encoding="utf-8").replace('"attachment"', '"flange"')
    (tmp_path / "biorob.urdf").write_text(text, encoding="utf-8")
    words = ROBOT.path.read_text(encoding="utf-8").replace("attachment", "flange")
    (tmp_path / "biorob.yaml").write_text(words, encoding="utf-8")
    described = describe_bag(DATA / "static_spring" / "spring1", load_robot(tmp_path / "biorob.yaml"))
    assert not described.usable and "no link 'attachment'" in described.problem


@needs_biorob
def test_a_tour_of_rests_is_told_before_the_computation_begins():
    stream = io.StringIO()
    first_look(ROBOT, [read_motion(DATA / "static_gravity" / "gravity", ROBOT)], stream)
    assert "the motors stand 28 % of the time" in stream.getvalue()
    assert "rests take seconds as such, and minutes as motion" in stream.getvalue()
