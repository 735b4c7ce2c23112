# SPDX-License-Identifier: BSD-3-Clause
"""The option --leave-out."""

from __future__ import annotations

import numpy as np
import pytest

from jointscope.robots.errors import RecordingError
from jointscope.robots.recordings.recording import Recording, Stream
from jointscope.tools.command_line import main
from jointscope.tools.presentation.left_out import leave_out, left_out_arguments, recording_arguments
from jointscope.tools.verb_parts.discovery_state import hashes_of


def recording(path):
    """Ten seconds at some place."""
    times = np.arange(0.0, 10.0, 0.01)
    command = Stream("command", times, np.ones((len(times), 1)), ("joint1.command",), "1")
    return Recording(path, "", 0, {"command": command})


def test_one_recording_needs_no_name():
    (without,) = leave_out([recording("bags/a.mcap")], ["1.5:2", "a.mcap:3:4"])
    assert without.left_out == ((1.5, 2.0), (3.0, 4.0))


def test_several_are_told_apart_by_name_or_path():
    first, second = leave_out([recording("bags/a.mcap"), recording("b.mcap")], ["b.mcap:1:2", "bags/a.mcap:3:4"])
    assert first.left_out == ((3.0, 4.0),) and second.left_out == ((1.0, 2.0),)
    assert left_out_arguments([first, second]) == ["bags/a.mcap:3:4", "b.mcap:1:2"]
    again = leave_out([recording("bags/a.mcap"), recording("b.mcap")], left_out_arguments([first, second]))
    assert [r.left_out for r in again] == [first.left_out, second.left_out]


def test_recordings_of_the_same_name_are_told_apart_by_their_folders():
    bags = [recording("day1/run.mcap"), recording("day2/run.mcap")]
    chosen = leave_out(bags, ["./day2/run.mcap:1:2"])
    assert [r.left_out for r in chosen] == [(), ((1.0, 2.0),)]
    assert leave_out(bags, left_out_arguments(chosen)) == chosen
    with pytest.raises(RecordingError, match=r"2 recordings are meant; .* one of day1/run\.mcap, day2/run\.mcap"):
        leave_out(bags, ["run.mcap:1:2"])


def test_paths_may_hold_colons():
    (without,) = leave_out([recording("runs/12:30.mcap")], ["12:30.mcap:1:2"])
    assert without.left_out == ((1.0, 2.0),)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1", "expected [BAG:]T0:T1 with times in seconds"),
        ("", "expected [BAG:]T0:T1 with times in seconds"),
        ("a:b", "expected [BAG:]T0:T1 with times in seconds"),
        ("1:2", "2 recordings are meant; expected [BAG:]T0:T1 with BAG one of a.mcap, b.mcap"),
        ("c.mcap:1:2", "there is no recording c.mcap; expected"),
        ("a.mcap:2:1", "a.mcap: cannot leave out 2 to 1 s"),
    ],
)
def test_other_texts_are_refused_in_words(text, said):
    with pytest.raises(RecordingError) as caught:
        leave_out([recording("a.mcap"), recording("b.mcap")], [text])
    assert said in str(caught.value)


def test_a_discovery_is_not_continued_with_other_stretches(doggy):
    plain, without = recording("a.mcap"), recording("a.mcap").leaving_out([(1.0, 2.0)])
    assert hashes_of(doggy, [plain], None, []) != hashes_of(doggy, [without], None, [])
    assert hashes_of(doggy, [plain], without, []) != hashes_of(doggy, [plain], plain, [])


@pytest.mark.parametrize("verb", ["calibrate", "diagnose", "discover", "compare", "report"])
def test_every_verb_that_judges_models_has_the_option(verb, capsys):
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    assert "--leave-out" in capsys.readouterr().out


def test_recordings_are_named_without_what_was_left_out_of_them():
    first, second = recording("a b.mcap").leaving_out([(1.0, 2.5)]), recording("c.mcap")
    assert recording_arguments([first, second]) == "'a b.mcap' c.mcap --leave-out 'a b.mcap:1:2.5'"
    assert recording_arguments([]) == "BAG"
