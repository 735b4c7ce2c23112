# SPDX-License-Identifier: BSD-3-Clause
"""`init` puts the streams of a bag on one clock as `calibrate` does, so that its regression is right at once."""

from __future__ import annotations

import re

import numpy as np
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.command_line import main

ARM = {"shoulder": None, "elbow": "shoulder"}
HOUR = 3600 * 10**9
STAMPS = {
    "hours ahead": (lambda stamp: stamp + 2 * HOUR, "its stamps are 2 h 0 min ahead of those of the other streams"),
    "two seconds behind": (lambda stamp: stamp - 2 * 10**9, "its stamps are 2 s behind those of the other streams"),
    "not filled": (lambda stamp: 0, "all its stamps are zero; the time of reception stands in for it"),
    "filled once": (lambda stamp: 7 * 10**9, "all its stamps are 7.000 s; the time of reception stands in for it"),
    "filled in the last quarter": (lambda stamp: stamp if stamp > 10**18 + 4.5e9 else 0, "stamps are zero in "),
    "a tick of 50 ms": (
        lambda stamp: stamp // 50_000_000 * 50_000_000,
        "it has 120 stamps for 1200 messages",
    ),
    "no fractions": (lambda stamp: stamp // 10**9 * 10**9, "its stamps hold whole seconds only; the time of reception"),
}


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    urdf = write_urdf(tmp_path_factory.mktemp("arm") / "arm.urdf", ARM)
    return urdf, ArmMotion(urdf, tuple(ARM))


def written(arm, tmp_path, stamped):
    """A bag with other stamps in some topics."""
    motion = arm[1]
    topics = {"/joint_states": motion.states(), "/motor_command": motion.commands(tuple(ARM))}
    topics = {
        name: content | ({"stamped": stamped[name]} if name in stamped else {}) for name, content in topics.items()
    }
    return write_arm_bag(tmp_path / "arm.mcap", motion.times, topics, latency=2e-4)


def regression_of(arm, tmp_path, capsys, stamped):
    """Lines of the regression's table by joint, and all that `init` says."""
    urdf, bag = arm[0], written(arm, tmp_path, stamped)
    assert main(["init", str(urdf), str(bag), "-o", str(tmp_path / "arm.yaml")]) == 0
    said = capsys.readouterr().out
    rows = {line.split()[0]: line for line in said.splitlines() if re.match(r"  (shoulder|elbow) +[0-9]", line)}
    return rows, said


@pytest.mark.parametrize("topic", ["/joint_states", "/motor_command"])
@pytest.mark.parametrize("kind", STAMPS)
def test_the_regression_is_right_whatever_clock_a_stream_has(arm, tmp_path, capsys, kind, topic):
    stamped, told = STAMPS[kind]
    rows, said = regression_of(arm, tmp_path, capsys, {topic: stamped})
    assert told in said
    assert "can be used with it" in said
    for joint in ARM:
        gain, inertia, dry, viscous = (float(x) for x in re.findall(r"([0-9.-]+) \+-", rows[joint]))
        assert (gain, viscous) == (pytest.approx(1.0, rel=0.01), pytest.approx(0.4, rel=0.02))
        assert (dry, inertia) == (pytest.approx(0.3, rel=0.03), pytest.approx(0.05, rel=0.1))


def test_without_any_filled_stamp_all_streams_go_by_their_reception(arm, tmp_path, capsys):
    nothing = STAMPS["not filled"][0]
    rows, said = regression_of(arm, tmp_path, capsys, {"/joint_states": nothing, "/motor_command": nothing})
    assert said.count("all its stamps are zero") == 2
    assert all(re.search(r" 1\.0+\d* \+-", line) or " 0.99" in line for line in rows.values())


@pytest.mark.parametrize("kind", ["hours ahead", "not filled", "no fractions"])
def test_a_replay_has_the_same_clock(arm, tmp_path, kind):
    stamped, told = STAMPS[kind]
    bag = written(arm, tmp_path, {"/motor_command": stamped})
    assert main(["init", str(arm[0]), str(bag), "-o", str(tmp_path / "arm.yaml")]) == 0
    reader = ArrivalReader(bag, load_robot(tmp_path / "arm.yaml"), block=500)
    arrived = np.concatenate([block.stamps for block in reader])
    assert arrived - arrived.min() == pytest.approx(np.repeat(arm[1].times, 2), abs=1e-3)
    assert any(told.partition(";")[0] in text for text in reader.notices())


def test_a_recorder_whose_clock_went_back_is_told_as_that(arm, tmp_path, capsys):
    """Bags are read by times of reception: two stretches lie on each other, as from two nodes."""
    motion = arm[1]
    times = np.where(motion.times > 3.0, motion.times - 2.0023, motion.times)
    topics = {"/joint_states": motion.states(), "/motor_command": motion.commands(tuple(ARM))}
    bag = write_arm_bag(tmp_path / "arm.mcap", times, topics)
    assert main(["init", str(arm[0]), str(bag), "-o", str(tmp_path / "arm.yaml")]) == 1
    said = capsys.readouterr().err
    assert "the clock of the recorder was set back" in said
    assert "/joint_states" in said
