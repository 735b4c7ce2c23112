# SPDX-License-Identifier: BSD-3-Clause
"""Plain mistakes are said before a computation begins, and bad recordings by name."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError, SolveError
from jointscope.robots.recordings.recording import Notice
from jointscope.robots.recordings.target_plausibility import LATE_TRACKER, MOVED_TRACKER
from jointscope.tools.bags.write_bag import write_bag
from jointscope.tools.command_line import main
from jointscope.tools.verb_parts.first_look import first_look


@pytest.fixture
def swapped(simulated):
    """The simulated recording with two axes of imu2 exchanged."""
    stream = simulated.recording.streams["imu2"]
    values = replace(stream, values=stream.values[:, [1, 0, 2]])
    return replace(simulated.recording, path="odd.mcap", streams={**simulated.recording.streams, "imu2": values})


def said(robot, *recordings):
    stream = io.StringIO()
    first_look(robot, recordings, stream)
    return stream.getvalue()


def test_a_clean_recording_passes_without_a_word(doggy, simulated):
    assert said(doggy, simulated.recording) == ""


def test_swapped_axes_are_said_once_with_the_recording_that_showed_them(doggy, simulated, swapped):
    text = said(doggy, simulated.recording, swapped, replace(swapped, path="again.mcap"))
    assert text.startswith("odd.mcap: imu2: the axes seem swapped or flipped against R_imu_body: ")
    assert "again.mcap" not in text and text.count("\n") == 2
    assert "Look at this first" in text


def test_a_speed_beyond_the_limit_of_the_urdf_is_told_as_such_and_not_as_a_long_calibration(
    doggy, simulated, monkeypatch
):
    stream = simulated.recording.streams["motor_encoder"]
    fastest = np.abs(stream.values[20:] - stream.values[:-20]).max() / (stream.times[20] - stream.times[0])
    allowed = property(lambda tree: np.full(3, fastest / 2.0))
    monkeypatch.setattr(type(doggy.tree), "velocity_limits", allowed)
    text = said(replace(doggy), simulated.recording)
    assert "moves at" in text and "a limit of the URDF may be wrong" in text and "takes long" not in text


@pytest.mark.parametrize("kind", [LATE_TRACKER, MOVED_TRACKER])
def test_a_tracker_that_is_late_or_moved_is_told_before_the_calibration_takes_its_minutes(
    kind, doggy, simulated, monkeypatch
):
    told = [Notice("tip", kind, 100, "tip is late, by about 20 ms"), Notice("imu1", "gap", 1, "a gap")]
    monkeypatch.setattr("jointscope.tools.verb_parts.first_look.screen_all", lambda recording, robot: told)
    text = said(doggy, simulated.recording)
    assert "tip is late, by about 20 ms\n" in text and "a gap" not in text and "takes long to calibrate" in text


def test_a_recording_that_cannot_be_used_is_named(doggy, simulated):
    stream = simulated.recording.streams["imu1"]
    dead = replace(stream, values=np.zeros_like(stream.values))
    broken = replace(simulated.recording, path="dead.mcap", streams={**simulated.recording.streams, "imu1": dead})
    with pytest.raises(RecordingError, match=r"^dead\.mcap: imu1\.x never changes"):
        said(doggy, simulated.recording, broken)


@pytest.mark.parametrize("verb", ["calibrate", "diagnose", "discover"])
def test_verbs_that_take_long_say_it_before_they_begin(verb, doggy, swapped, tmp_path, monkeypatch, capsys):
    def begin(*args, **kwargs):
        raise SolveError("here the computation begins")

    bag = tmp_path / "odd.mcap"
    write_bag(bag, swapped, doggy)
    place = f"tools.notebook.calls.{verb}_motion"
    monkeypatch.setattr(f"jointscope.{place}", begin)
    output = ["-o", str(tmp_path / "out.yaml")] if verb != "diagnose" else []
    assert main([verb, "doggy", str(bag), *output]) == 1
    first, second, last = capsys.readouterr().err.splitlines()
    assert first.startswith(f"{bag}: imu2: the axes seem swapped or flipped") and "Look at this first" in second
    assert last == "jointscope: error: here the computation begins"
