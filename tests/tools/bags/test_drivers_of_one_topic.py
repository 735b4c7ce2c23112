# SPDX-License-Identifier: BSD-3-Clause
"""Drivers that each publish their own joint on one topic are one robot, whatever their rates."""

from __future__ import annotations

import json

import numpy as np
import pytest
from arm_bags import ArmMotion, write_arm_bag, write_urdf

from jointscope.robots.files.robot_file import load_robot
from jointscope.tools.bags.read_arrivals import ArrivalReader
from jointscope.tools.bags.read_recording import read_recording
from jointscope.tools.command_line import main

TRUE = {"coulomb_torque": 0.3, "motor_viscous.coefficient": 0.4, "inertia": 0.05}


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A URDF, a motion, and the times at which two drivers publish: 100 Hz and 40 Hz, together now and then."""
    folder = tmp_path_factory.mktemp("drivers")
    urdf = write_urdf(folder / "arm.urdf", {"shoulder": None, "elbow": "shoulder"})
    motion = ArmMotion(urdf, ["shoulder", "elbow"], seconds=4.0)
    every = np.arange(len(motion.times))
    return folder, urdf, motion, {"shoulder": every[::2], "elbow": every[1::5]}


def _instants(rows):
    """Number of times at which any driver publishes."""
    return len(set().union(*(own.tolist() for own in rows.values())))


@pytest.fixture(scope="module")
def halves(arm):
    folder, _, motion, rows = arm
    states = {f"/joint_states#{joint}": motion.states([joint]) | {"rows": rows[joint]} for joint in rows}
    states["/cmd"] = motion.commands(["elbow", "shoulder"])
    return write_arm_bag(folder / "halves.mcap", motion.times, states)


def test_the_door_opens_and_the_values_are_right(arm, halves, tmp_path, capsys):
    _, urdf, _, rows = arm
    robot, found, told = tmp_path / "arm.yaml", tmp_path / "found.yaml", tmp_path / "found.json"
    assert main(["init", str(urdf), str(halves), "-o", str(robot)]) == 0
    assert "the recording can be used with it" in capsys.readouterr().out
    assert main(["info", str(halves), "--robot", str(robot)]) == 0
    out = capsys.readouterr().out
    assert "The recording can be used for arm." in out and "not finite" not in out and "left out" not in out
    assert main(["calibrate", str(robot), str(halves), "-o", str(found), "--json", str(told)]) == 0
    values = json.loads(told.read_text())["parameters"]
    for joint in rows:
        for name, true in TRUE.items():
            got = values[f"{joint}.{name}"]
            assert abs(got["value"] - true) < max(0.01 * true, 3.5 * got["sigma"]), name
    assert "Yes, this calibration is good" in capsys.readouterr().out
    assert main(["replay", str(found), str(halves)]) == 0
    out = capsys.readouterr().out
    assert f"All {_instants(rows) + len(arm[2].times)} messages were used" in out
    assert "ok Agrees with the batch smoother" in out


def test_each_joint_has_its_own_samples_and_nothing_else(arm, halves, tmp_path):
    _, urdf, motion, rows = arm
    robot = tmp_path / "arm.yaml"
    assert main(["init", str(urdf), str(halves), "-o", str(robot)]) == 0
    stream = read_recording(halves, load_robot(robot)).streams["motor_encoder"]
    (block,) = list(ArrivalReader(halves, load_robot(robot)))
    arrived = block.values[block.names.index("motor_encoder")]
    for j, (joint, own) in enumerate(rows.items()):
        seen = np.isfinite(stream.measured[:, j])
        np.testing.assert_allclose(stream.times[seen], motion.times[own], atol=1e-9)
        assert stream.measured[seen, j].tolist() == motion.position[joint][own].tolist()
        assert arrived[np.isfinite(arrived[:, j]), j].tolist() == motion.position[joint][own].tolist()


@pytest.mark.parametrize("held", (True, False))
def test_a_command_of_one_joint_leaves_those_of_the_others(arm, halves, tmp_path, held):
    _, urdf, motion, rows = arm
    commands = {f"/cmd#{joint}": motion.commands([joint]) | {"rows": rows[joint]} for joint in rows}
    bag = write_arm_bag(tmp_path / "both.mcap", motion.times, {"/joint_states": motion.states(), **commands})
    robot = tmp_path / "arm.yaml"
    assert main(["init", str(urdf), str(halves), "-o", str(robot)]) == 0
    text = robot.read_text()
    assert "held: false" in text
    robot.write_text(text.replace("held: false", f"held: {str(held).lower()}"))
    stream = read_recording(bag, load_robot(robot)).streams["command"]
    (block,) = list(ArrivalReader(bag, load_robot(robot)))
    online = block.values[block.names.index("command")]
    assert len(stream) == len(online) == _instants(rows)
    for j, (joint, own) in enumerate(rows.items()):
        times, given = motion.times[own], motion.effort[joint][own]
        if held:
            expected = given[np.maximum(np.searchsorted(times, stream.times + 1e-9, side="right") - 1, 0)]
            np.testing.assert_array_equal(stream.values[1:, j], expected[1:])
            np.testing.assert_array_equal(online[1:, j], expected[1:])
        else:
            on_the_way = np.interp(stream.times, times, given, left=np.nan)  # nobody knows what acted before
            on_the_way[np.abs(stream.times - times[0]) < 1e-9] = given[0]
            np.testing.assert_allclose(online[:, j], on_the_way, atol=1e-6)
            own_rows = np.isin(np.round(1e6 * stream.times), np.round(1e6 * times))
            np.testing.assert_array_equal(stream.values[own_rows, j], given)


NODES = {
    # first and last row of the shoulder's messages, and of the elbow's: states at 100 Hz, commands at 250 Hz
    "one millisecond behind each other": {"states": (0, None, 1, None), "commands": (0, None, 1, None)},
    "half begins late": {"states": (0, None, 1605, None), "commands": (0, None, 2, None)},
    "half ends early": {"states": (0, None, 5, 2400), "commands": (0, None, 2, None)},
    "half is commanded late": {"states": (0, None, 2, None), "commands": (0, None, 1605, None)},
    "half is no longer commanded": {"states": (0, None, 2, None), "commands": (0, None, 2, 2400)},
}


@pytest.fixture(scope="module")
def fast(tmp_path_factory):
    """As `arm`, sampled so fast that nodes may speak just behind each other."""
    folder = tmp_path_factory.mktemp("nodes")
    urdf = write_urdf(folder / "arm.urdf", {"shoulder": None, "elbow": "shoulder"})
    return urdf, ArmMotion(urdf, ["shoulder", "elbow"], seconds=4.0, rate=1000.0)


@pytest.mark.parametrize("nodes", NODES)
def test_nodes_may_speak_just_behind_each_other_begin_late_and_end_early(fast, tmp_path, capsys, nodes):
    urdf, motion = fast
    every = np.arange(len(motion.times))
    topics = {}
    for kind, (first, last, other, end) in NODES[nodes].items():
        step = 10 if kind == "states" else 4
        for joint, own in (("shoulder", every[first:last:step]), ("elbow", every[other:end:step])):
            of_joint = motion.states([joint]) if kind == "states" else motion.commands([joint])
            topics[f"{'/joint_states' if kind == 'states' else '/cmd'}#{joint}"] = of_joint | {"rows": own}
    bag = write_arm_bag(tmp_path / "nodes.mcap", motion.times, topics)
    robot, found, told = tmp_path / "arm.yaml", tmp_path / "found.yaml", tmp_path / "found.json"
    assert main(["init", str(urdf), str(bag), "-o", str(robot)]) == 0
    out = capsys.readouterr().out
    assert "the recording can be used with it" in out and "no number" not in out
    cut = nodes != "one millisecond behind each other"
    assert ("left out, as too little is known there" in out and "of elbow for" in out) == cut
    start = load_robot(robot)
    assert main(["calibrate", str(robot), str(bag), "-o", str(found), "--json", str(told)]) == 0
    assert "Yes, this calibration is good" in capsys.readouterr().out
    values = json.loads(told.read_text())["parameters"]
    for joint in ("shoulder", "elbow"):
        for name, true in TRUE.items():
            got = values[f"{joint}.{name}"]
            assert abs(got["value"] - true) < max(0.01 * true, 3.5 * got["sigma"]), name
            assert start.parameters[f"{joint}.{name}"].value == pytest.approx(true, rel=0.05), name
    assert main(["replay", str(found), str(bag), "--json", str(told)]) == 0
    out = capsys.readouterr().out
    if nodes == "half is commanded late":
        assert "before those of all joints had arrived" in out
    assert ("nothing of elbow.command since" in out) == (nodes == "half is no longer commanded")
    if nodes != "half is no longer commanded":
        assert json.loads(told.read_text())["nis_mean"] < 1.5


def test_positions_that_one_node_wraps_are_unwrapped_between_its_own_messages(fast, tmp_path, capsys):
    urdf, motion = fast
    every = np.arange(len(motion.times))
    topics = {"/cmd": motion.commands(["shoulder", "elbow"]) | {"rows": every[::4]}}
    for joint, own in (("shoulder", every[::10]), ("elbow", every[3::10])):
        states = motion.states([joint])
        topics[f"/joint_states#{joint}"] = states | {"position": np.mod(states["position"], 2 * np.pi), "rows": own}
    bag = write_arm_bag(tmp_path / "wrapped.mcap", motion.times, topics)
    robot, found, told = tmp_path / "arm.yaml", tmp_path / "found.yaml", tmp_path / "found.json"
    assert main(["init", str(urdf), str(bag), "-o", str(robot)]) == 0
    assert "the recording can be used with it" in capsys.readouterr().out
    assert "wraps: 6.283" in robot.read_text()
    assert main(["calibrate", str(robot), str(bag), "-o", str(found), "--json", str(told)]) == 0
    values = json.loads(told.read_text())["parameters"]
    for joint in ("shoulder", "elbow"):
        for name, true in TRUE.items():
            got = values[f"{joint}.{name}"]
            assert abs(got["value"] - true) < max(0.01 * true, 3.5 * got["sigma"]), name


@pytest.mark.parametrize("aggregated", (40, 4))
def test_an_aggregator_that_repeats_what_two_nodes_say_is_left_out_unless_it_says_more(
    fast, tmp_path, capsys, aggregated
):
    urdf, motion = fast
    every = np.arange(len(motion.times))
    topics = {"/cmd": motion.commands(["shoulder", "elbow"]) | {"rows": every[::4]}}
    for joint, own in (("shoulder", every[::10]), ("elbow", every[2::10])):
        topics[f"/joint_states#{joint}"] = motion.states([joint]) | {"rows": own}
    late = motion.states(["shoulder", "elbow"]) | {"rows": every[7:-60:aggregated]}
    late |= {"stamped": lambda stamp: stamp + 50_000_000} if aggregated > 10 else {}
    bag = write_arm_bag(tmp_path / "aggregator.mcap", motion.times, topics | {"/joint_states#all": late})
    robot = tmp_path / "arm.yaml"
    assert main(["init", str(urdf), str(bag), "-o", str(robot)]) == 0
    out = capsys.readouterr().out
    assert "the recording can be used with it" in out
    repeated = f"left out {len(late['rows'])} messages of another node that repeats what those of the joints say"
    assert (repeated in out) == (aggregated > 10)
    stream = read_recording(bag, load_robot(robot)).streams["motor_encoder"]
    (block,) = list(ArrivalReader(bag, load_robot(robot)))
    arrived = block.values[block.names.index("motor_encoder")]
    kept = [len(every[::10]), len(every[2::10])] if aggregated > 10 else 2 * [len(late["rows"])]
    assert np.isfinite(stream.measured).sum(axis=0).tolist() == np.isfinite(arrived).sum(axis=0).tolist() == kept
    for joint in ("shoulder", "elbow"):
        assert load_robot(robot).parameters[f"{joint}.inertia"].value == pytest.approx(0.05, rel=0.05), joint


def test_a_list_that_is_shorter_than_its_names_is_said_with_both_lengths(arm, tmp_path, capsys):
    _, urdf, motion, _ = arm
    command = motion.commands(["shoulder", "elbow"])
    command["effort"] = command["effort"][:, :1]
    bag = write_arm_bag(tmp_path / "short.mcap", motion.times, {"/joint_states": motion.states(), "/cmd": command})
    assert main(["init", str(urdf), str(bag), "-o", str(tmp_path / "arm.yaml")]) == 1
    assert (
        "/cmd has 1 value in `effort` for 2 names (shoulder, elbow); expected one for each" in capsys.readouterr().err
    )


def test_a_relay_of_the_commands_changes_nothing(arm, tmp_path, capsys):
    _, urdf, motion, _ = arm
    every, late = np.arange(len(motion.times)), np.arange(0, len(motion.times) - 20, 2)
    command = motion.commands(["shoulder", "elbow"])
    relay = command | {"rows": late, "stamped": lambda stamp: stamp + 61_000_000}
    topics = {"/joint_states": motion.states(), "/cmd": command | {"rows": every}, "/cmd#relay": relay}
    bag = write_arm_bag(tmp_path / "relay.mcap", motion.times, topics)
    assert main(["init", str(urdf), str(bag), "-o", str(tmp_path / "arm.yaml")]) == 0
    assert (
        f"left out {len(late)} messages of a second node that repeats those of the driver 61" in capsys.readouterr().out
    )
    recording = read_recording(bag, load_robot(tmp_path / "arm.yaml"))
    assert recording.streams["command"].values[:, 0].tolist() == motion.effort["shoulder"].tolist()
    (block,) = list(ArrivalReader(bag, load_robot(tmp_path / "arm.yaml")))
    assert len(block) == 2 * len(every)
