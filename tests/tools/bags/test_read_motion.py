# SPDX-License-Identifier: BSD-3-Clause
"""Rests that are given as motion: known loads are refused with the command that takes them, many pauses are told."""

from __future__ import annotations

from pathlib import Path

import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_motion import read_motion

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
