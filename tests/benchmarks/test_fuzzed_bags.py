# SPDX-License-Identifier: BSD-3-Clause
"""A tenth of the fuzzer: damaged bags end in one line, whole files, and in time; the fuzzer itself is repeatable."""

from __future__ import annotations

import signal

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the sound recording is simulated")

from fuzz_messages import FORMATS, sound_messages, write_messages
from fuzz_mutations import OF_BYTES, OF_MESSAGES
from fuzz_trial import damaged_bag, run_trial, sound_robot_file

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")  # which a user would see
TRIALS, DEEP, STRETCH = 200, 8, 25
FOUND, FOUND_DEEP = (338, 916, 1479, 1562), (15, 116)  # others that found something once
HANG = 60  # [s] of computing


@pytest.fixture(autouse=True)
def no_hang():
    def ring(*_):
        raise TimeoutError(f"a trial does not end within {HANG} s")

    before = signal.signal(signal.SIGPROF, ring)
    yield
    signal.setitimer(signal.ITIMER_PROF, 0)
    signal.signal(signal.SIGPROF, before)


def findings(trials, deep=False):
    found = []
    for trial in trials:
        signal.setitimer(signal.ITIMER_PROF, HANG)
        found += run_trial(trial, deep)
    return [f"trial {f.trial} ({f.damage}): {f.verb}: {f.what}: {f.where}" for f in found]


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, TRIALS, STRETCH))
def test_damaged_bags_end_info_and_init_in_one_line(first):
    assert findings(range(first, first + STRETCH)) == []


@pytest.mark.slow
def test_damaged_bags_end_calibrate_and_replay_in_one_line():
    assert findings(range(DEEP), deep=True) == []


@pytest.mark.slow
def test_what_was_found_once_stays_mended():
    assert findings(FOUND) + findings(FOUND_DEEP, deep=True) == []


def test_the_sound_recording_gives_a_robot_file_with_both_joints():
    assert "joints: [shoulder, elbow]" in sound_robot_file()


def test_a_trial_makes_the_same_bag_again(tmp_path):
    for trial in (1, 6):  # a folder and a .db3
        made = []
        for place in ("a", "b"):
            (tmp_path / f"{place}{trial}").mkdir()
            name, damage = damaged_bag(trial, tmp_path / f"{place}{trial}")
            path = tmp_path / f"{place}{trial}" / name
            files = [path] if path.is_file() else sorted(path.iterdir())
            made.append((damage, [file.read_bytes() for file in files]))
        assert made[0] == made[1]


@pytest.mark.parametrize("name", sorted(OF_MESSAGES))
def test_messages_can_still_be_written_after_any_change(name, tmp_path):
    rng = np.random.default_rng(7)
    for k in range(3):
        changed = OF_MESSAGES[name](rng, OF_MESSAGES["odd_numbers"](rng, list(sound_messages())))
        assert write_messages(tmp_path / f"bag{k}", changed, FORMATS[k]).exists()
    assert OF_MESSAGES[name](rng, []) == []


@pytest.mark.parametrize("name", sorted(OF_BYTES))
def test_bytes_are_changed(name):
    rng = np.random.default_rng(8)
    data = rng.bytes(5000)
    assert any(OF_BYTES[name](rng, data) != data for _ in range(3))
