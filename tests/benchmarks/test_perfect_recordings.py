# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark of perfect recordings hears every accusation."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

pytest.importorskip("mujoco", reason="the recordings are simulated")

import perfect_recordings
from arm_row import ACCUSING
from perfect_recordings import accusations

from jointscope.robots.files.robot_file import load_robot
from jointscope.robots.recordings.recording import Notice
from jointscope.tools.simulator import simulate


def test_a_notice_of_a_mistake_is_an_accusation_and_one_of_jitter_is_not():
    robot = load_robot("doggy")
    recording = simulate(robot, "calibration", 1.5, 1, friction="smooth").recording
    before = accusations(robot, recording)
    notices = (Notice("imu1", "axes", 1, "imu1: x and y are exchanged"), Notice("command", "jitter", 1, "late"))
    after = accusations(robot, replace(recording, notices=(*recording.notices, *notices)))
    assert after == [*before, "imu1: x and y are exchanged"]


def test_sentences_about_pushes_accuse_and_those_about_numbers_do_not():
    assert ACCUSING.search("run.mcap: from 1 to 2 s up to 0.3 N m act on joint1.link: a push from outside")
    assert not ACCUSING.search("6 parameters from 500 samples: typically +-10 %, worst elbow.inertia with +-17 %")


class Moment:
    def sentence(self, recording):
        return f"a push in {recording.path}"


def test_what_calibrate_and_compare_name_is_counted_and_shown(monkeypatch):
    calibration = SimpleNamespace(findings=("all is explained", "a collision at 3 s"), robot=None)
    monkeypatch.setattr(perfect_recordings, "SECONDS", {"calibration": 1.5, "moves": 1.5})
    monkeypatch.setattr(perfect_recordings, "accusations", lambda robot, recording: [])
    monkeypatch.setattr(perfect_recordings, "calibrate", lambda robot, recordings: calibration)
    monkeypatch.setattr(perfect_recordings, "compare_model", lambda *_: SimpleNamespace(isolated=(Moment(),)))
    section = perfect_recordings.run(quick=True)
    (promise,) = section.targets
    assert (promise.measured, promise.met) == ("2", False)
    assert [row[1] for row in section.tables[0].rows] == ["calibrate", "compare"]
